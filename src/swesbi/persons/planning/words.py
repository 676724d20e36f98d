"""A planned study in words and as a table: what is needed, what is assumed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from swesbi.persons.planning.effect import Effect
from swesbi.persons.planning.power import OnePersonPower, PowerCurve
from swesbi.persons.settings import PAIRED, PlanSettings


@dataclass(frozen=True)
class Plan:
    """The answer to what was asked: curves by number of repeats, and what each says of one person.

    ``noise`` is the standard deviation of one repeat's speed, as a fraction; ``persons`` a number for which
    power is reported besides; ``rule`` threshold and probability by which one person's change is called.
    """

    effect: Effect
    design: str
    power: float
    noise: float
    persons: int | None
    curves: tuple[PowerCurve, ...]
    individuals: Mapping[int, OnePersonPower | None]
    settings: PlanSettings
    rule: tuple[float, float]

    @property
    def unit(self) -> str:
        """What numbers of persons count."""
        return "persons, each recorded twice" if self.design == PAIRED else "persons in each of two groups"


def plan_lines(planned: Plan) -> list[str]:
    """Return what is needed for each number of repeats, and what all of it assumes."""
    head = f"{planned.effect.words}, {planned.design}, repeats with errors of {planned.noise:.1%}:"
    return [
        head,
        *(line for curve in planned.curves for line in curve_lines(planned, curve)),
        *assumption_lines(planned),
    ]


def curve_lines(planned: Plan, curve: PowerCurve) -> list[str]:
    """Return what one number of repeats needs and promises."""
    lines = [f"  {curve.repeats} repeats: {_needed(planned, curve)}"]
    if planned.persons is not None:
        power, false = curve.at(planned.persons)
        lines.append(
            f"    {planned.persons} {planned.unit}: power {power:.0%}; found without any effect in "
            f"{false:.1%}"
        )
    own = planned.individuals.get(curve.repeats)
    if own is not None:
        threshold, probability = planned.rule
        lines.append(
            f"    one person: a change beyond {threshold:.0%} is called (probability above {probability:g}) "
            f"in {own.called:.0%} of {own.persons} persons with the effect, wrongly in {own.wrongly:.0%} "
            f"without; the smallest change that can be detected is {own.detectable:.0%} in the middle person"
        )
    return lines


def _needed(planned: Plan, curve: PowerCurve) -> str:
    number, fewest, most = curve.needed
    if number is None:
        return (
            f"a power of {planned.power:.0%} is not reached by {curve.sizes[-1]} {planned.unit}: there it is "
            f"{curve.power[-1]:.0%} (standard error {curve.power_se[-1]:.1%})"
        )
    power, false = curve.at(number)
    least = fewest if fewest is not None else number
    upper = f"to {most}" if most is not None else f"or more than {curve.sizes[-1]}"
    return (
        f"{number} {planned.unit} ({least} {upper} by Monte Carlo error), for a power of {power:.0%}; found "
        f"without any effect in {false:.1%}"
    )


def assumption_lines(planned: Plan) -> list[str]:
    """Return what the answer assumes, in sentences."""
    persons, studies = planned.settings.persons, planned.settings.studies
    paired = planned.design == PAIRED
    return [
        "This assumes:",
        "- hearts that the model's equations nearly make (with inertance of wall and valves beside them), of "
        f"the group {persons.group!r}, theta spread over {persons.prior_share:.0%} of the prior's width",
        f"- an effect of {planned.effect.words} in the middle person, spread by "
        f"{persons.response_spread:.0%} between persons, and on this parameter alone",
        f"- from visit to visit {persons.visit_spread:.0%} in theta, {persons.loading_spread:.0%} in "
        f"loading, {persons.heart_rate_spread:.0%} in heart rate; visits share what `changes.shares` says"
        if paired
        else "- groups alike in age, sex, heart rate and all else: by chance, or by matching; no slopes are "
        "inferred on them",
        f"- recordings as `acquisition` describes them with errors scaled to {planned.noise:.1%}, all of "
        "none of which is contradicted: plan some more persons for those refused or lost",
        f"- a study finds the effect where the probability of its direction is above "
        f"{planned.settings.probability:g}; {studies.studies} studies of each size, drawn with replacement "
        f"from {persons.number} simulated persons; what is known of their luck is taken off, the rest is "
        "part of the Monte Carlo error",
    ]


def plan_table(planned: Plan) -> pd.DataFrame:
    """Return a row a number of repeats and persons."""
    return pd.concat([_rows(planned, curve) for curve in planned.curves], ignore_index=True)


def _rows(planned: Plan, curve: PowerCurve) -> pd.DataFrame:
    own = planned.individuals.get(curve.repeats)
    needed = ["" if number is None else str(number) for number in curve.needed]
    return pd.DataFrame(
        {
            "effect": f"{planned.effect.parameter}={planned.effect.change:+g}",
            "design": planned.design,
            "repeats": curve.repeats,
            "noise_fraction": planned.noise,
            "persons": curve.sizes,
            "power_1": curve.power,
            "power_se_1": curve.power_se,
            "false_positive_1": curve.false_positive,
            "power_asked_1": planned.power,
            "persons_needed": needed[0],
            "persons_needed_low": needed[1],
            "persons_needed_high": needed[2],
            "one_person_called_1": own.called if own else float("nan"),
            "one_person_wrongly_1": own.wrongly if own else float("nan"),
            "one_person_detectable_1": own.detectable if own else float("nan"),
        }
    )

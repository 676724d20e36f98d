"""Power by the number of persons, in words and as a table: studies from a bank, at common points of a grid.

Persons of a study are drawn from the bank with replacement: the bank's persons stand for the population, also
where a study has more of them. What is known of the bank's chance variation is taken off
(``planning.likelihoods``). How much is left the same studies of resampled banks say, each with its own
chance variation taken off (bootstrap): its variance is added to that of the number of studies. A bank without
an effect is made to have none: each person of pairs counts a second time with the visits the other way round,
and of two groups both are drawn from the same persons.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.base.progress import Progress
from swesbi.persons.planning.effect import Effect
from swesbi.persons.planning.likelihoods import Likelihoods
from swesbi.persons.planning.simulation import ARMS, EFFECT, NONE, STREAM, Bank
from swesbi.persons.settings import PAIRED, PlannedStudiesSettings, PlanSettings
from swesbi.seeds import generator

NINETY: Final = 1.645


@dataclass(frozen=True)
class PowerCurve:
    """Power by number of persons (k,), for one number of repeats; of each group where there are two.

    ``power_se`` is its Monte Carlo standard error, that of the bank included. ``needed`` are the persons for
    the power asked for, and at the ends of its Monte Carlo interval; None where no number tried is enough.
    """

    repeats: int
    sizes: IntArray
    power: FloatArray
    power_se: FloatArray
    false_positive: FloatArray
    needed: tuple[int | None, int | None, int | None]

    def at(self, persons: int) -> tuple[float, float]:
        """Return power and false positives at a number of persons within those tried."""
        root, at = np.sqrt(self.sizes.astype(float)), np.sqrt(persons)
        return float(np.interp(at, root, self.power)), float(np.interp(at, root, self.false_positive))


def draw_counts(
    bank: IntArray, persons: int, size: int, studies: int, rng: np.random.Generator
) -> FloatArray:
    """Draw studies of ``size`` persons from a bank, with replacement; shape (persons, studies).

    The bank is given by places, one of which may be there several times.
    """
    chosen = bank[rng.integers(len(bank), size=(size, studies))]
    counts = np.zeros((persons, studies))
    np.add.at(counts, (chosen, np.arange(studies)), 1.0)
    return counts


def power_curve(
    likelihoods: Likelihoods,
    repeats: int,
    settings: PlannedStudiesSettings,
    rule: tuple[float, float],
    seed: int,
) -> PowerCurve:
    """Return power and false positives at every size, and the size for the power asked for.

    ``rule`` is the probability above which a study finds the effect, and that power.
    """
    probability, power = rule
    everyone = np.arange(len(likelihoods.response))

    def called(
        arm: str, size: int, studies: int, bank: IntArray, rng: np.random.Generator, moved: float = 0.0
    ) -> BoolArray:
        persons = likelihoods.by_arm[arm].terms.shape[-1]
        counts, control = (draw_counts(bank, persons, size, studies, rng) for _ in range(2))
        return likelihoods.probability(counts, control, arm, moved) > probability

    def resampled(size: int, rng: np.random.Generator) -> BoolArray:
        """Judge studies in equal parts, each of a bank drawn from the bank with replacement."""
        parts, each = [], max(1, settings.studies // settings.resamples)
        for _ in range(settings.resamples):
            bank = rng.integers(len(everyone), size=len(everyone))
            parts.append(called(EFFECT, size, each, bank, rng, likelihoods.displacement(bank)))
        return np.concatenate(parts)

    without, moved = np.arange(likelihoods.by_arm[NONE].terms.shape[-1]), likelihoods.displacement(everyone)
    rows = []
    progress = Progress(f"studies with {repeats} repeats", len(settings.sizes), unit="size")
    for size in settings.sizes:
        of_effect, of_none, of_bootstrap = (
            generator(seed, STREAM, "studies", repeats, size, what)
            for what in ("effect", "none", "bootstrap")
        )
        found = called(EFFECT, size, settings.studies, everyone, of_effect, moved)
        none = called(NONE, size, settings.studies, without, of_none)
        error = _error(found, resampled(size, of_bootstrap), settings.resamples)
        rows.append((found.mean(), error, none.mean()))
        progress.step()
    share, error, false = np.array(rows).T
    sizes = np.array(settings.sizes)
    middle, fewest, most = (
        persons_for(power, sizes, share + side * NINETY * error) for side in (0.0, 1.0, -1.0)
    )
    return PowerCurve(repeats, sizes, share, error, false, (middle, fewest, most))


def _error(called: BoolArray, resampled: BoolArray, resamples: int) -> float:
    """Return the standard error of a share of studies, that of the bank they were drawn from included."""
    share = float(called.mean())
    of_studies = share * (1.0 - share) / len(called)
    parts = [part.mean() for part in np.array_split(resampled, resamples)]
    within = np.mean([part * (1.0 - part) for part in parts]) / (len(resampled) / resamples)
    of_bank = max(float(np.var(parts, ddof=1)) - float(within), 0.0)
    return float(np.sqrt(of_studies + of_bank))


def persons_for(power: float, sizes: Sequence[int] | IntArray, found: FloatArray) -> int | None:
    """Return the least number of persons for a power; None where none of those tried has it.

    Power never falls with persons, so the shares found are made monotone, and taken linear in the root of the
    number between those tried.
    """
    from sklearn.isotonic import IsotonicRegression

    root = np.sqrt(np.asarray(sizes, dtype=float))
    rising = np.asarray(IsotonicRegression().fit_transform(root, np.clip(found, 0.0, 1.0)))
    if rising[-1] < power:
        return None
    least = int(np.argmax(rising >= power))
    if least == 0:
        return int(sizes[0])
    step = (power - rising[least - 1]) / (rising[least] - rising[least - 1])
    return int(np.ceil((root[least - 1] + step * (root[least] - root[least - 1])) ** 2 - 1e-9))


@dataclass(frozen=True)
class OnePersonPower:
    """What `changes.rule` calls among the persons of a bank: shares with the effect and without.

    ``detectable`` is the median over persons of the smallest change that can be detected, as a fraction.
    """

    called: float
    wrongly: float
    detectable: float
    persons: int


def one_person_power(bank: Bank, effect: Effect, probability: float) -> OnePersonPower | None:
    """Return what the protocol says of one person; None where persons came once.

    A change is called where its probability beyond the threshold is above this one (``changes.rule``).
    """
    with_effect, without = ARMS.index(EFFECT), ARMS.index(NONE)
    if np.isnan(bank.risen).any():
        return None
    right = (bank.risen if effect.change > 0.0 else bank.fallen)[:, with_effect, effect.number]
    either = np.maximum(bank.risen, bank.fallen)[:, without, effect.number]
    return OnePersonPower(
        called=float((right > probability).mean()),
        wrongly=float((either > probability).mean()),
        detectable=float(np.median(bank.detectable[:, with_effect, effect.number])),
        persons=len(bank.number),
    )


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

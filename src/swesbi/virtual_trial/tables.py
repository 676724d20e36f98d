"""The tables of the virtual trial: its subjects, the truth, and what the drug truly did in these persons."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Final

import numpy as np
import pandas as pd

from swesbi.arrays import FloatArray
from swesbi.checks.pressures import ATTAINED
from swesbi.parameters import THETA
from swesbi.virtual_trial.persons import TrialPerson, TrialVisit
from swesbi.virtual_trial.settings import CONTROL, GROUPS, TREATED

QUANTITIES: Final = {parameter.name: parameter.text for parameter in THETA} | {ATTAINED: "attained stiffness"}
"""What is told of the drug, by the columns of the truth."""


def subject_table(persons: Sequence[TrialPerson]) -> pd.DataFrame:
    """Return the rows of ``subjects.csv``: the context of each visit, and whose it is."""
    rows = [asdict(visit.context) | _whose(person, visit) for person in persons for visit in person.visits]
    return pd.DataFrame(rows).astype(object)


def truth_table(persons: Sequence[TrialPerson]) -> pd.DataFrame:
    """Return one row a recording: what is true of the heart at that visit, which nobody measures."""
    return pd.DataFrame([_truth_row(person, visit) for person in persons for visit in person.visits])


def _whose(person: TrialPerson, visit: TrialVisit) -> dict[str, str]:
    return {"person": person.name, "visit": visit.visit, "group": person.group}


def _truth_row(person: TrialPerson, visit: TrialVisit) -> dict[str, str | float]:
    theta = {name: visit.phi[name] for name in QUANTITIES if name in visit.phi}
    beat = {ATTAINED: visit.attained_kpa, "ejection_fraction": visit.ejection_fraction}
    others = {name: value for name, value in visit.phi.items() if name not in theta}
    return {"subject": visit.context.subject, **_whose(person, visit), **theta, **beat, **others}


def log_ratios(truth: pd.DataFrame, quantity: str, group: str) -> FloatArray:
    """Return log(second visit / first) of each person of a group, shape (n,), from the table of truths."""
    own = truth.loc[truth["group"] == group, quantity].to_numpy(np.float64).reshape(-1, 2)
    return np.asarray(np.log(own[:, 1] / own[:, 0]))


def effect_table(truth: pd.DataFrame) -> pd.DataFrame:
    """Return, as texts, what truly changed: geometric mean of the ratios by group, and of both together."""
    rows = []
    for name, text in QUANTITIES.items():
        own = {group: log_ratios(truth, name, group) for group in GROUPS}
        shown = {f"{group}, second / first visit": _ratio(ratios) for group, ratios in own.items()}
        change = float(np.exp(own[TREATED].mean() - own[CONTROL].mean()))
        rows.append({"": text, **shown, "treated / control": f"{change:.3f}"})
    return pd.DataFrame(rows)


def _ratio(log_ratio: FloatArray) -> str:
    """Return the geometric mean with the spread of single persons about it."""
    return f"{np.exp(log_ratio.mean()):.3f} (single persons ± {100.0 * log_ratio.std(ddof=1):.0f} %)"


def person_table(persons: Sequence[TrialPerson]) -> pd.DataFrame:
    """Return the persons as texts: who they are, and theta and the attained stiffness at both visits."""
    return pd.DataFrame([_person_row(person) for person in persons])


def _person_row(person: TrialPerson) -> dict[str, str]:
    first, second = person.visits
    values = {f"{text}{_unit(name)}": _both(person, name) for name, text in QUANTITIES.items()}
    return {
        "": person.name,
        "group": person.group,
        "sex, age": f"{first.context.sex}, {first.context.age_years:g}",
        "heart rate (1/min)": f"{first.context.hr_bpm:.0f}, {second.context.hr_bpm:.0f}",
        **values,
    }


def _unit(name: str) -> str:
    return next((f" ({parameter.unit})" for parameter in THETA if parameter.name == name), " (kPa)")


def _both(person: TrialPerson, name: str) -> str:
    values = [visit.attained_kpa if name == ATTAINED else visit.phi[name] for visit in person.visits]
    return ", ".join(f"{value:.1f}" for value in values)


def drawn_again(persons: Sequence[TrialPerson]) -> Counter[str]:
    """Return how many did not take part, by reason."""
    return Counter(reason for person in persons for reason in person.drawn_again)

"""The population of contexts: its streams, its distributions, its limits."""

from __future__ import annotations

import copy
from dataclasses import asdict, replace
from functools import cache
from typing import Any, Final

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from population_case import EXPERIMENT
from pydantic import ValidationError
from scipy.linalg import block_diag
from scipy.special import logit

from swesbi.context import Context
from swesbi.population.contexts import DrawnContext, draw_contexts, draw_population
from swesbi.population.settings import DECLARED_NAMES, PopulationSettings, in_declared_range
from swesbi.recording.settings import ContextRow

Plain = dict[str, Any]

SEED: Final = 3
COUNT: Final = 6000
WALL: Final = {"relative_thickness": [0.04, 1.0]}
CORRELATION: Final = [
    [1.0, 0.3, 0.0, 0.0, 0.0],
    [0.3, 1.0, -0.4, 0.0, 0.0],
    [0.0, -0.4, 1.0, 0.2, -0.3],
    [0.0, 0.0, 0.2, 1.0, 0.0],
    [0.0, 0.0, -0.3, 0.0, 1.0],
]
CORRELATED: Final = ("bsa_m2", "hr_bpm", "lvedv_ml", "ivsd_cm", "ejection_fraction")
SHARES: Final = {"adults": 0.7, "children": 0.3}
SHIPPED: Final[Plain] = EXPERIMENT.population.to_plain()["groups"]
PLAIN: Final[Plain] = {
    "broad_share": 0.3,
    "declared_range": {"hr_bpm": [30.0, 200.0], "lvedv_ml": [12.0, 450.0], "ivsd_cm": [0.3, 2.0], **WALL},
    "groups": {
        name: SHIPPED[name] | {"share": share, "correlation": CORRELATION} for name, share in SHARES.items()
    },
}
NARROW: Final = {"hr_bpm": [60.0, 95.0], "lvedv_ml": [60.0, 120.0], "ivsd_cm": [0.6, 0.9], **WALL}
"""Limits that refuse a good part of the draws."""
ANYTHING: Final = {"hr_bpm": [30.0, 200.0], "lvedv_ml": [10.0, 500.0], "ivsd_cm": [0.2, 3.0], **WALL}
"""Limits within which many cavities are too large or small for the body or for the wall."""


def _population(**changes: object) -> PopulationSettings:
    return PopulationSettings.from_plain({**copy.deepcopy(PLAIN), **changes})


@cache
def _drawn() -> tuple[DrawnContext, ...]:
    return draw_population(range(COUNT), _population(), SEED, "calibration")


def _deviations(group: str, sex: str) -> NDArray[np.float64]:
    """Deviations from the medians, by definition, in units of their standard deviations; shape (n, 5)."""
    contexts = [one.context for one in _drawn() if one.group == group and one.context.sex == sex]
    drawn = pd.DataFrame([asdict(context) for context in contexts])
    drawn["ejection_fraction"] = 1.0 - drawn["lvesv_ml"] / drawn["lvedv_ml"]
    found = []
    for name in CORRELATED:
        curve = PLAIN["groups"][group][{"F": "female", "M": "male"}[sex]][name]
        log_median = np.interp(drawn["age_years"], curve["age_years"], np.log(curve["median"]))
        if "bsa_exponent" in curve:
            log_median += curve["bsa_exponent"] * np.log(drawn["bsa_m2"] / curve["at_bsa_m2"])
        if name == "ejection_fraction":
            found.append((logit(drawn[name]) - logit(np.exp(log_median))) / curve["logit_sd"])
        else:
            found.append((np.log(drawn[name]) - log_median) / curve["log_sd"])
    return np.column_stack(found)


def test_a_context_is_the_same_in_every_batch() -> None:
    population = _population(declared_range=NARROW)
    whole = draw_contexts(range(60), population, SEED, "training", broad=True)
    parts = [draw_contexts(range(k, 60, 7), population, SEED, "training", broad=True) for k in range(7)]
    assert sorted((one for part in parts for one in part), key=lambda one: one.subject) == list(whole)
    assert [one.subject for one in whole[:2]] == ["P000001", "P000002"]


def test_the_stream_depends_on_seed_name_and_number() -> None:
    streams = [
        (SEED, "training", 5),
        (SEED + 1, "training", 5),
        (SEED, "calibration", 5),
        (SEED, "training", 6),
    ]
    ages = {draw_contexts([at], _population(), seed, name)[0].age_years for seed, name, at in streams}
    ages.add(draw_contexts([5], _population(), SEED, "training", 1)[0].age_years)
    assert len(ages) == 5


def test_the_order_of_the_groups_in_the_configuration_changes_nothing() -> None:
    swapped = _population(groups=dict(reversed(PLAIN["groups"].items())))
    assert draw_population(range(50), swapped, SEED, "calibration") == _drawn()[:50]


def test_shares_of_groups_and_sexes() -> None:
    # Four standard errors of a share of 6000 draws: 0.024 at most.
    share = np.mean([one.group == "adults" for one in _drawn()])
    assert abs(share - 0.7) < 0.024
    assert abs(np.mean([one.context.sex == "M" for one in _drawn()]) - 0.5) < 0.026
    for group in SHARES:
        low, high = PLAIN["groups"][group]["age_years"]
        ages = np.array([one.context.age_years for one in _drawn() if one.group == group])
        assert low <= ages.min() < low + 0.5 and high - 0.5 < ages.max() <= high
        assert abs(ages.mean() - (low + high) / 2) < 4 * (high - low) / np.sqrt(12 * ages.size)


@pytest.mark.parametrize("sex", ["F", "M"])
@pytest.mark.parametrize("group", ["adults", "children"])
def test_distributions_and_correlations_are_those_of_the_settings(group: str, sex: str) -> None:
    deviations = _deviations(group, sex)
    error = 4 / np.sqrt(len(deviations))
    np.testing.assert_allclose(deviations.mean(axis=0), 0.0, atol=error)
    np.testing.assert_allclose(deviations.std(axis=0), 1.0, atol=error / np.sqrt(2.0))
    np.testing.assert_allclose(np.corrcoef(deviations.T), CORRELATION, atol=error)


@pytest.mark.parametrize(("limits", "broad"), [(NARROW, False), (NARROW, True), (ANYTHING, True)])
def test_every_draw_is_within_the_limits_and_plausible(limits: Plain, broad: bool) -> None:
    population = _population(broad_share=0.9, declared_range=limits)
    drawn = draw_population(range(500), population, SEED, "training", broad=broad)
    assert sum(one.redrawn for one in drawn) > 30
    for one in drawn:
        assert in_declared_range(one.context, population) == ()
        assert ContextRow(**asdict(one.context)).to_context() == one.context


def test_limits_do_not_change_who_is_drawn() -> None:
    limited = draw_population(range(500), _population(declared_range=NARROW), SEED, "calibration")
    for one, other in zip(_drawn()[:500], limited, strict=True):
        assert (one.group, one.context.sex) == (other.group, other.context.sex)
        assert one.context.age_years == other.context.age_years


def test_limits_that_no_body_meets_are_refused() -> None:
    population = _population(declared_range=PLAIN["declared_range"] | {"hr_bpm": [190.0, 200.0]})
    with pytest.raises(RuntimeError, match="compare its distributions with `declared_range`"):
        draw_contexts([0], population, SEED, "calibration")


OF_WALL: Final = PLAIN["declared_range"] | {"relative_thickness": [0.15, 0.7]}
THICK: Final = {"lvedv_ml": 60.0, "ivsd_cm": 1.9}


@pytest.mark.parametrize(
    ("limits", "changes", "problems"),
    [
        (NARROW, {}, ""),
        (NARROW, {"hr_bpm": 60.0, "ivsd_cm": 0.9}, ""),
        (
            NARROW,
            {"hr_bpm": 140.0, "lvedv_ml": 59.9},
            "hr_bpm = 140 is outside [60, 95]; lvedv_ml = 59.9 is outside [60, 120]",
        ),
        (NARROW, {"hr_bpm": float("nan")}, "hr_bpm = nan is outside [60, 95]"),
        (
            OF_WALL,
            THICK,
            "ivsd_cm = 1.9 is 0.782 of the radius of a sphere of lvedv_ml = 60, outside [0.15, 0.7]",
        ),
        (
            OF_WALL,
            {"lvedv_ml": 300.0, "ivsd_cm": 0.5},
            "ivsd_cm = 0.5 is 0.12 of the radius of a sphere of lvedv_ml = 300, outside [0.15, 0.7]",
        ),
        (OF_WALL, THICK | {"lvedv_ml": 100.0}, ""),
    ],
)
def test_a_value_or_a_wall_for_its_cavity_beyond_what_is_declared_is_outside(
    limits: Plain, changes: dict[str, float], problems: str
) -> None:
    context = Context("X", "F", 30.0, 1.7, 70.0, 80.0, 30.0, 0.75)
    found = in_declared_range(replace(context, **changes), _population(declared_range=limits))
    assert "; ".join(found) == problems


def test_the_broad_share_covers_the_declared_range() -> None:
    population = _population()
    drawn = draw_population(range(3000), population, SEED, "training", broad=True)
    broad = [one.context for one in drawn if one.broad]
    assert abs(len(broad) / len(drawn) - 0.3) < 4 * np.sqrt(0.3 * 0.7 / len(drawn))
    hr = np.log([one.hr_bpm for one in broad])
    low, high = np.log(population.declared_range.hr_bpm)
    # Uniform in log: the quartiles of the declared range are those of the draws.
    quartiles = low + np.array([0.25, 0.5, 0.75]) * (high - low)
    assert np.all(np.abs(np.quantile(hr, [0.25, 0.5, 0.75]) - quartiles) < 0.12 * (high - low))
    for name in DECLARED_NAMES:
        reach = np.ptp(np.log([getattr(one, name) for one in broad]))
        assert reach > 0.8 * np.ptp(np.log(population.declared_range.limits(name)))
    fractions = [1.0 - one.lvesv_ml / one.lvedv_ml for one in broad]
    assert min(fractions) > 0.4 and max(fractions) < 0.85


def test_broad_training_leaves_the_other_contexts_alone() -> None:
    plain = draw_population(range(200), _population(), SEED, "training")
    broad = draw_population(range(200), _population(), SEED, "training", broad=True)
    assert not any(one.broad for one in plain)
    assert all(one == other for one, other in zip(plain, broad, strict=True) if not other.broad)
    assert any(other.broad for other in broad)


IMPOSSIBLE: Final = [[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]]


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("groups", "adults", "share"), 0.5, "sum to 0.8, they must sum to 1"),
        (("groups", "adults", "age_years"), [80.0, 20.0], "low < high"),
        (("groups", "adults", "male", "hr_bpm", "age_years"), [10.0, 20.0], "2 ages, but 1 medians"),
        (("groups", "adults", "male", "lvedv_ml", "age_years"), [80.0, 50.0, 20.0], "ages must ascend"),
        (("groups", "adults", "male", "ejection_fraction", "median"), [61.0], "fractions must be below 1"),
        (("groups", "adults", "correlation", 0, 1), 0.2, "symmetric with ones"),
        (
            ("groups", "adults", "correlation"),
            block_diag(IMPOSSIBLE, np.eye(2)).tolist(),
            "positive definite",
        ),
        (("declared_range", "hr_bpm"), [20.0, 130.0], "the limits of the model"),
        (("declared_range", "ivsd_cm"), [1.4, 0.4], "low < high"),
        (("declared_range", "relative_thickness"), [0.1, 1.2], "the limits of the model"),
    ],
)
def test_bad_settings_are_refused(path: tuple[str | int, ...], value: object, message: str) -> None:
    plain = copy.deepcopy(PLAIN)
    inner: Any = plain
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    with pytest.raises(ValidationError, match=message):
        PopulationSettings.from_plain(plain)

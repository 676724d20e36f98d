"""The population of contexts: its streams, its distributions, its limits, its figure."""

from __future__ import annotations

import copy
import logging
from dataclasses import asdict, replace
from functools import cache
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

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


def _body(bsa: list[float], hr: float, lvedv: list[float], exponent: float, ivsd: float, ef: float) -> Plain:
    """A body whose BSA and LVEDV follow age, the others not."""
    ages = [10.0, 20.0] if exponent > 1.0 else [20.0, 80.0]
    at = {"at_bsa_m2": 1.2 if exponent > 1.0 else 1.8}
    return {
        "bsa_m2": {"age_years": ages, "median": bsa, "log_sd": 0.10},
        "hr_bpm": {"age_years": [10.0], "median": [hr], "log_sd": 0.14},
        "lvedv_ml": {"age_years": ages, "median": lvedv, "log_sd": 0.15, "bsa_exponent": exponent, **at},
        "ivsd_cm": {"age_years": [10.0], "median": [ivsd], "log_sd": 0.09, "bsa_exponent": 0.5, **at},
        "ejection_fraction": {"age_years": [10.0], "median": [ef], "logit_sd": 0.2},
    }


PLAIN: Final[Plain] = {
    "broad_share": 0.3,
    "declared_range": {"hr_bpm": [30.0, 200.0], "lvedv_ml": [12.0, 450.0], "ivsd_cm": [0.3, 2.0], **WALL},
    "groups": {
        "adults": {
            "share": 0.7,
            "age_years": [20.0, 80.0],
            "female": _body([1.65, 1.75], 74.0, [82.0, 70.0], 1.0, 0.72, 0.64),
            "male": _body([1.90, 1.98], 68.0, [110.0, 95.0], 1.0, 0.82, 0.61),
            "correlation": CORRELATION,
        },
        "children": {
            "share": 0.3,
            "age_years": [8.0, 18.0],
            "female": _body([1.10, 1.60], 88.0, [70.0, 76.0], 1.3, 0.60, 0.66),
            "male": _body([1.12, 1.80], 84.0, [75.0, 80.0], 1.3, 0.63, 0.65),
            "correlation": CORRELATION,
        },
    },
}


def _population(**changes: object) -> PopulationSettings:
    return PopulationSettings.from_plain({**copy.deepcopy(PLAIN), **changes})


@cache
def _drawn() -> tuple[DrawnContext, ...]:
    return draw_population(range(COUNT), _population(), SEED, "calibration")


def _narrow() -> PopulationSettings:
    """The population within limits that refuse a good part of its draws."""
    return _population(
        declared_range={"hr_bpm": [60.0, 95.0], "lvedv_ml": [60.0, 120.0], "ivsd_cm": [0.6, 0.9], **WALL}
    )


def _log_median(name: str, one: DrawnContext, plain: Plain) -> float:
    """The median by definition, from the plain settings: line between ages, power of BSA."""
    context = one.context
    curve = plain["groups"][one.group]["male" if context.sex == "M" else "female"][name]
    ages, logs = curve["age_years"], np.log(curve["median"])
    value = logs[0]
    if len(ages) == 2:
        part = min(max((context.age_years - ages[0]) / (ages[1] - ages[0]), 0.0), 1.0)
        value = logs[0] + part * (logs[1] - logs[0])
    if "bsa_exponent" in curve:
        value += curve["bsa_exponent"] * np.log(context.bsa_m2 / curve["at_bsa_m2"])
    return float(value)


def _deviations(drawn: list[DrawnContext]) -> NDArray[np.float64]:
    """Deviations from the medians, in log (logit for the last); shape (n, 5)."""
    names = ("bsa_m2", "hr_bpm", "lvedv_ml", "ivsd_cm")
    rows = []
    for one in drawn:
        logs = [np.log(getattr(one.context, name)) - _log_median(name, one, PLAIN) for name in names]
        fraction = 1.0 - one.context.lvesv_ml / one.context.lvedv_ml
        median = np.exp(_log_median("ejection_fraction", one, PLAIN))
        rows.append([*logs, np.log(fraction / (1.0 - fraction)) - np.log(median / (1.0 - median))])
    return np.array(rows)


def _of(group: str, sex: str) -> list[DrawnContext]:
    return [one for one in _drawn() if one.group == group and one.context.sex == sex]


def test_a_context_is_the_same_in_every_batch() -> None:
    population = _narrow()
    whole = draw_contexts(range(60), population, SEED, "training", broad=True)
    parts = [draw_contexts(range(k, 60, 7), population, SEED, "training", broad=True) for k in range(7)]
    assert sorted((one for part in parts for one in part), key=lambda one: one.subject) == list(whole)
    backwards = draw_contexts(range(59, -1, -1), population, SEED, "training", broad=True)
    assert backwards == whole[::-1]
    assert [one.subject for one in whole[:2]] == ["P000001", "P000002"]


def test_the_stream_depends_on_seed_name_and_number() -> None:
    population = _population()
    ages = [
        draw_contexts([number], population, seed, *name)[0].age_years
        for seed, name, number in [
            (SEED, ("training",), 5),
            (SEED + 1, ("training",), 5),
            (SEED, ("calibration",), 5),
            (SEED, ("training", 1), 5),
            (SEED, ("training",), 6),
        ]
    ]
    assert len(set(ages)) == len(ages)


def test_the_order_of_the_groups_in_the_configuration_changes_nothing() -> None:
    swapped = _population(groups=dict(reversed(PLAIN["groups"].items())))
    again = PopulationSettings.from_plain(_population().to_plain())
    for other in (swapped, again):
        assert draw_population(range(50), other, SEED, "calibration") == _drawn()[:50]


def test_shares_of_groups_and_sexes() -> None:
    # Four standard errors of a share of 6000 draws: 0.024 at most.
    share = np.mean([one.group == "adults" for one in _drawn()])
    assert abs(share - 0.7) < 0.024
    assert abs(np.mean([one.context.sex == "M" for one in _drawn()]) - 0.5) < 0.026
    for group, (low, high) in {"adults": (20.0, 80.0), "children": (8.0, 18.0)}.items():
        ages = np.array([one.context.age_years for one in _drawn() if one.group == group])
        assert low <= ages.min() < low + 0.5 and high - 0.5 < ages.max() <= high
        standard_error = (high - low) / np.sqrt(12 * ages.size)
        assert abs(ages.mean() - (low + high) / 2) < 4 * standard_error


@pytest.mark.parametrize("sex", ["F", "M"])
@pytest.mark.parametrize("group", ["adults", "children"])
def test_distributions_and_correlations_are_those_of_the_settings(group: str, sex: str) -> None:
    own = _of(group, sex)
    deviations = _deviations(own)
    expected = np.array([0.10, 0.14, 0.15, 0.09, 0.2])
    count = len(own)
    assert np.all(np.abs(deviations.mean(axis=0)) < 4 * expected / np.sqrt(count))
    assert np.all(np.abs(deviations.std(axis=0) / expected - 1.0) < 4 / np.sqrt(2 * count))
    assert np.all(np.abs(np.corrcoef(deviations.T) - np.array(CORRELATION)) < 4 / np.sqrt(count))


def test_children_are_not_small_adults() -> None:
    values = {
        group: np.array([one.context.as_array() for one in _drawn() if one.group == group])
        for group in ("adults", "children")
    }
    child, adult = np.median(values["children"], axis=0), np.median(values["adults"], axis=0)
    assert child[2] < adult[2] - 0.3
    assert child[3] > adult[3] + 8.0
    assert child[6] < adult[6] - 0.08
    by_bsa = {
        group: np.polyfit(np.log(rows[:, 2]), np.log(rows[:, 4]), 1)[0]
        for group, rows in (("adults", _rows("adults", "F")), ("children", _rows("children", "F")))
    }
    assert abs(by_bsa["children"] - 1.3) < 0.25 and by_bsa["children"] > by_bsa["adults"]


def _rows(group: str, sex: str) -> NDArray[np.float64]:
    return np.array([one.context.as_array() for one in _of(group, sex)])


@pytest.mark.parametrize("broad", [False, True])
def test_every_draw_is_within_the_limits_and_plausible(broad: bool) -> None:
    population = _narrow()
    drawn = draw_population(range(1000), population, SEED, "training", broad=broad)
    assert sum(one.redrawn for one in drawn) > 100
    for one in drawn:
        assert in_declared_range(one.context, population) == ()
        assert ContextRow(**asdict(one.context)).to_context() == one.context


def test_implausible_draws_are_drawn_again() -> None:
    # Over this whole range many cavities are too large or small for the body or for the wall.
    population = _population(
        broad_share=0.99,
        declared_range={"hr_bpm": [30.0, 200.0], "lvedv_ml": [10.0, 500.0], "ivsd_cm": [0.2, 3.0], **WALL},
    )
    drawn = draw_population(range(500), population, SEED, "training", broad=True)
    assert sum(one.redrawn for one in drawn) > 30
    for one in drawn:
        ContextRow(**asdict(one.context))


def test_limits_do_not_change_who_is_drawn() -> None:
    free, limited = _drawn()[:500], draw_population(range(500), _narrow(), SEED, "calibration")
    who = [
        [(one.group, one.context.sex, one.context.age_years) for one in drawn] for drawn in (free, limited)
    ]
    assert who[0] == who[1]


def test_draws_outside_the_limits_are_reported(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, logger="swesbi"):
        draw_contexts(range(200), _narrow(), SEED, "calibration")
    redrawn = sum(one.redrawn for one in draw_population(range(200), _narrow(), SEED, "calibration"))
    assert f"{redrawn} of {redrawn + 200} draws outside the limits" in caplog.text


def test_limits_that_no_body_meets_are_refused() -> None:
    population = _population(
        declared_range={"hr_bpm": [190.0, 200.0], "lvedv_ml": [12.0, 450.0], "ivsd_cm": [0.3, 2.0], **WALL}
    )
    with pytest.raises(RuntimeError, match="compare its distributions with `declared_range`"):
        draw_contexts([0], population, SEED, "calibration")


def test_the_declared_range_refuses_outside() -> None:
    context = Context("X", "F", 30.0, 1.7, 70.0, 80.0, 30.0, 0.75)
    population = _narrow()
    assert in_declared_range(context, population) == ()
    assert in_declared_range(replace(context, hr_bpm=60.0, ivsd_cm=0.9), population) == ()
    problems = in_declared_range(replace(context, hr_bpm=140.0, lvedv_ml=59.9), population)
    assert problems == ("hr_bpm = 140 is outside [60, 95]", "lvedv_ml = 59.9 is outside [60, 120]")
    assert in_declared_range(replace(context, ivsd_cm=float("nan")), population) != ()


def test_a_septum_too_thick_or_too_thin_for_its_cavity_is_outside_though_each_value_is_within() -> None:
    declared = PLAIN["declared_range"] | {"relative_thickness": [0.15, 0.7]}
    population = _population(declared_range=declared)
    thick = Context("X", "F", 30.0, 1.7, 70.0, 60.0, 20.0, 1.9)
    assert in_declared_range(thick, population) == (
        "ivsd_cm = 1.9 is 0.782 of the radius of a sphere of lvedv_ml = 60, outside [0.15, 0.7]",
    )
    assert in_declared_range(replace(thick, lvedv_ml=100.0), population) == ()
    assert in_declared_range(replace(thick, lvedv_ml=300.0, ivsd_cm=0.5), population) != ()
    drawn = draw_population(range(300), population, SEED, "training", broad=True)
    assert any(one.redrawn for one in drawn if one.broad)
    thickness = [one.context.relative_thickness for one in drawn]
    assert min(thickness) >= 0.15 and max(thickness) <= 0.7


def test_the_broad_share_covers_the_declared_range() -> None:
    population = _population()
    drawn = draw_population(range(3000), population, SEED, "training", broad=True)
    broad = [one for one in drawn if one.broad]
    assert abs(len(broad) / len(drawn) - 0.3) < 4 * np.sqrt(0.3 * 0.7 / len(drawn))
    hr = np.log([one.context.hr_bpm for one in broad])
    low, high = np.log(population.declared_range.hr_bpm)
    # Uniform in log: the quartiles of the declared range are those of the draws.
    quartiles = low + np.array([0.25, 0.5, 0.75]) * (high - low)
    assert np.all(np.abs(np.quantile(hr, [0.25, 0.5, 0.75]) - quartiles) < 0.12 * (high - low))
    reach = [np.ptp(np.log([getattr(one.context, name) for one in broad])) for name in DECLARED_NAMES]
    whole = [np.ptp(np.log(population.declared_range.limits(name))) for name in DECLARED_NAMES]
    assert np.all(np.array(reach) > 0.8 * np.array(whole))
    fractions = [1.0 - one.context.lvesv_ml / one.context.lvedv_ml for one in broad]
    assert min(fractions) > 0.4 and max(fractions) < 0.85


def test_broad_training_leaves_the_other_contexts_alone() -> None:
    plain = draw_population(range(200), _population(), SEED, "training")
    broad = draw_population(range(200), _population(), SEED, "training", broad=True)
    assert not any(one.broad for one in plain)
    assert [one for one in broad if not one.broad] == [
        one for one, other in zip(plain, broad, strict=True) if not other.broad
    ]


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("groups", "adults", "share"), 0.5, "sum to 0.8, they must sum to 1"),
        (("groups", "adults", "age_years"), [80.0, 20.0], "low < high"),
        (("groups", "adults", "male", "hr_bpm", "age_years"), [10.0, 20.0], "2 ages, but 1 medians"),
        (("groups", "adults", "male", "bsa_m2", "age_years"), [80.0, 20.0], "ages must ascend"),
        (("groups", "adults", "male", "ejection_fraction", "median"), [61.0], "fractions must be below 1"),
        (("groups", "adults", "correlation", 0, 1), 0.2, "symmetric with ones"),
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


def test_an_impossible_correlation_is_refused() -> None:
    plain = copy.deepcopy(PLAIN)
    matrix = np.eye(5)
    for one, other, value in ((0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)):
        matrix[one, other] = matrix[other, one] = value
    plain["groups"]["adults"]["correlation"] = matrix.tolist()
    with pytest.raises(ValidationError, match="positive definite"):
        PopulationSettings.from_plain(plain)

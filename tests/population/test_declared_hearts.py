"""The shipped population: its declared range holds hearts that beat, and its strata enough recordings."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from swesbi.checks.calibration.known import FRESH_STREAM
from swesbi.checks.calibration.scores import strata_of
from swesbi.config.read import read_merged, read_yaml
from swesbi.config.study import load_study
from swesbi.context import Context, sphere_radius_m
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats, simulate
from swesbi.population.contexts import draw_population
from swesbi.prior import quantile

ROOT: Final = Path(__file__).parents[2]
STUDY: Final = load_study(read_merged(ROOT / "config.yaml"))
AMORTISED: Final = STUDY.config.population_experiments["amortised"]
DECLARED: Final = AMORTISED.population.declared_range
CORNERS: Final = list(product(DECLARED.hr_bpm, DECLARED.lvedv_ml, DECLARED.relative_thickness))
FULL: Final = read_yaml(ROOT / "config" / "overlays" / "full.yaml")
LEAST_RECORDINGS: Final = 400  # coverage of 90 % to 3.0 points (two standard errors)


def corner(hr_bpm: float, lvedv_ml: float, relative_thickness: float) -> Context:
    """The heart nearest to this relative thickness whose septum is declared."""
    wanted = 100.0 * relative_thickness * sphere_radius_m(lvedv_ml)
    ivsd_cm = float(np.clip(wanted, *DECLARED.ivsd_cm))
    return Context("X", "F", 50.0, 1.8, hr_bpm, lvedv_ml, 0.4 * lvedv_ml, ivsd_cm)


def beats_of(context: Context) -> Beats:
    prior = STUDY.config.priors["calibrated"]
    theta = quantile(np.random.default_rng(5).random((100, 3)), prior)
    return simulate(theta, context, STUDY.config.forward_model)


@pytest.mark.parametrize("corners", CORNERS)
def test_every_corner_of_the_declared_range_beats_and_ejects(corners: tuple[float, float, float]) -> None:
    beats = beats_of(corner(*corners))
    assert (beats.status == Status.PERIODIC).all()
    assert np.median(beats.ejection_fraction) > 0.03
    assert beats.end_systolic_volume_ml.min() > 0.0


def test_what_the_relative_thickness_refuses_has_next_to_no_cavity() -> None:
    sphere = beats_of(Context("X", "F", 50.0, 1.8, 70.0, 35.0, 14.0, 2.0))
    assert np.median(sphere.end_diastolic_volume_ml) < 0.3 * 35.0


def test_each_stratum_of_the_full_calibration_has_enough_recordings() -> None:
    number = FULL["population_experiments"]["amortised"]["calibration"]["model_noise"]
    drawn = draw_population(range(number), AMORTISED.population, STUDY.config.seed, "fresh", FRESH_STREAM)
    # The noise levels, drawn from other streams, are cut into thirds of their logarithm.
    levels = np.exp(np.linspace(*np.log(AMORTISED.conditions.relative_se), number))
    parts = strata_of([one.context for one in drawn], levels, AMORTISED.calibration.strata)
    assert {name: int(part.sum()) for name, part in parts.items() if part.sum() < LEAST_RECORDINGS} == {}

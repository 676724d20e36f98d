"""Simulations over a population: independent of shards, kept to the byte; rows that are what they say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import population_case as case
import pytest
import speed_case

from swesbi.artefacts import Provenance
from swesbi.artefacts.typed import read_as
from swesbi.population.simulations import PopulationSimulations
from swesbi.population.training import split_by_context
from swesbi.prior import from_logit, log_density

PROVENANCE = Provenance("", "", 1, {}, "0" * 16)


@pytest.mark.parametrize("prior", ["paper", "calibrated"])
def test_shards_hold_what_one_run_would(tmp_path: Path, prior: str) -> None:
    whole, model = case.made(12, 5, prior), speed_case.settings(prior)
    for name, numbers in {"shard-1": (7, 12), "shard-0": (0, 7)}.items():
        case.shard(*numbers, 5, prior).write(tmp_path / f"{name}.h5", PROVENANCE)
    read = read_as(PopulationSimulations, [tmp_path / "shard-1.h5", tmp_path / "shard-0.h5"], "shards")
    assert read.contexts == whole.contexts
    assert read.nuisance_names == whole.nuisance_names == model.prior.theta.physiology_names
    assert whole.physiology.shape == (12, 5, len(whole.nuisance_names))
    arrays = [name for name, value in vars(whole).items() if isinstance(value, np.ndarray)]
    assert {"theta", "physiology", "active_stiffness_kpa", "shortening", "failures"} <= set(arrays)
    for name in arrays:
        assert np.array_equal(getattr(read, name), getattr(whole, name)), name


def test_hearts_differ_and_every_simulation_has_its_own_shortening() -> None:
    made = case.made()
    assert len({context.hr_bpm for context in made.contexts}) == 60
    assert np.ptp(made.shortening, axis=0).min() > 0.02
    assert np.ptp(made.shortening, axis=1).max(axis=-1).min() > 0.02


def test_no_context_is_on_both_sides_of_the_split() -> None:
    training, held_out = split_by_context(case.made(), 0.1)
    assert len(training.contexts) == 54
    assert not set(training.contexts) & set(held_out.contexts)
    assert np.array_equal(held_out.theta, case.made().theta[54:])
    with pytest.raises(ValueError, match="validation_fraction = 0.001"):
        split_by_context(case.made(), 0.001)


@pytest.mark.parametrize("prior", ["paper", "calibrated"])
def test_rows_have_the_hearts_that_were_simulated_and_fresh_noise_every_epoch(prior: str) -> None:
    made, maker = case.made(20, 20, prior), case.maker(prior)
    hearts = maker.model.prior.simulated
    (eta, first), (again, second) = (next(maker.raw(made, "epoch", number)) for number in (1, 2))
    heart = from_logit(eta, hearts)
    assert heart.shape == (400, len(hearts.names))
    assert np.isfinite(log_density(heart, hearts)).all()
    assert np.allclose(heart, np.dstack([made.theta, made.physiology]).reshape(400, -1))
    assert np.array_equal(eta, again)  # what the measurement takes is part of the noise
    assert not np.array_equal(first, second)
    assert np.array_equal(first, next(maker.raw(made, "epoch", 1))[1])


def test_the_noise_of_rows_is_that_of_their_standard_error_and_the_discrepancy() -> None:
    made = case.made()
    inputs = np.stack([next(case.MAKER.raw(made, "noise", k))[1] for k in range(120)])
    log_speed, missing, log_se = inputs[:, :, 3:23], inputs[:, :, 23:43], inputs[:, :, 43:63]
    low = (log_se < np.log(0.02)) & (missing == 0)
    high = (log_se > np.log(0.045)) & (missing == 0)
    # late diastole hardly depends on the scale of the active part; the scale's own spread is common to both
    spread = [np.nanstd(np.where(chosen, log_speed, np.nan), axis=0) for chosen in (low, high)]
    assert np.nanmedian(spread[1][:, 5] / spread[0][:, 5]) > 1.1


def test_training_learns() -> None:
    losses = case.trained().training["validation_loss"]
    assert losses.iloc[-1] < losses.iloc[0] - 0.3

"""The stages pool, train, posterior and recovery, on two small subjects of the real forward model."""

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from forward_model_cases import SETTINGS as FORWARD_MODEL
from inference_case import CONTEXTS, PAPER_PRIOR, estimator_settings
from recordings import PHASES, RECORDING, make_samples, nominal_phase

from swesbi.artefacts import ArtefactError, read_provenance, save
from swesbi.context import Context
from swesbi.forward_model import simulate
from swesbi.inference.dataset import read_pool, read_posterior
from swesbi.inference.estimator import load_estimator
from swesbi.inference.settings import (
    ObservationModelSettings,
    PosteriorSettings,
    RecoverySettings,
    SupportSettings,
)
from swesbi.inference.support import read_support
from swesbi.observation import (
    MeasurementSettings,
    PassiveSettings,
    SummarySettings,
    calibrate_passive,
    passive_shape,
    sample_cycle,
    summary_names,
)
from swesbi.observation.dataset import to_dataset as passive_to_dataset
from swesbi.recording import ingest
from swesbi.recording.dataset import to_datasets as observation_to_datasets
from swesbi.simulations.dataset import to_dataset as simulations_to_dataset
from swesbi.simulations.draw import draw_simulations
from swesbi.simulations.prior import log_centre
from swesbi.stages import pool, posterior, recovery, train
from swesbi.stages.origin import Origin

DRAWS = 60
TRUTH = np.array([[58.0, 6.0, 28.0]])
MEASUREMENT = MeasurementSettings(grid_points=100, active_stiffness_map="identity")
SUMMARY = SummarySettings(baseline_window=(0.8, 0.97), trajectory_points=30, use_trajectory=True)
NOISE = ObservationModelSettings(
    feature_noise_sd={
        "maximum_kpa": 1.0,
        "auc_kpa": 0.5,
        "post_peak_auc_kpa": 0.5,
        "decay_slope_kpa_per_cycle": 5.0,
        "time_to_peak_cycle": 0.03,
    },
    augmentations=3,
)
ESTIMATOR = estimator_settings(max_num_epochs=6, learning_rate=2e-3)
POOL = pool.PoolStageSettings(
    simulations_per_subject=DRAWS, measurement=MEASUREMENT, summary=SUMMARY, observation_model=NOISE
)
TRAIN = train.TrainStageSettings(prior=PAPER_PRIOR, estimator=ESTIMATOR)
POSTERIOR = posterior.PosteriorStageSettings(
    prior=PAPER_PRIOR,
    support=SupportSettings(max_abs_z=3.0, min_in_prior_draws=50, candidate_draws=2000),
    posterior=PosteriorSettings(draws=300, unfiltered_draws=100, interval=0.9),
)
RECOVERY = recovery.RecoveryStageSettings(
    prior=PAPER_PRIOR,
    forward_model=FORWARD_MODEL,
    measurement=MEASUREMENT,
    summary=SUMMARY,
    observation_model=NOISE,
    recovery=RecoverySettings(
        recordings=9, candidate_draws=200, min_in_prior_draws=5, nominal_levels=(0.5, 0.9), confidence=0.95
    ),
)


@dataclass(frozen=True)
class Inputs:
    """Files of two subjects; shards in pieces, or each subject's in one."""

    observations: tuple[Path, ...]
    passives: tuple[Path, ...]
    shards: tuple[Path, ...]
    whole_shards: tuple[Path, ...]


def write_subject(folder: Path, context: Context) -> Inputs:
    origin = Origin(1, context.subject)
    beats = simulate(TRUTH, context, FORWARD_MODEL)
    reference = simulate(log_centre(PAPER_PRIOR)[None], context, FORWARD_MODEL)
    total = beats.active_stiffness_kpa + 4.0 * passive_shape(beats.stretch, 3.0)
    speed = np.sqrt(sample_cycle(beats.cycle_phase, total, nominal_phase())[0] / 3.0)
    observed = ingest(make_samples(speed, 0.04, 0.08, seed=3), context, RECORDING, 100)
    measured = np.ones(PHASES, dtype=bool)
    measured[11] = False
    observed = replace(observed, measured=measured) if context.subject == "B" else observed
    window = PassiveSettings(exponent_b=3.0, late_diastolic_window=(0.8, 0.97))
    baseline = calibrate_passive(observed, reference, window, MEASUREMENT)
    observation, passive = folder / "observation.h5", folder / "passive.h5"
    save(observation, observation_to_datasets(observed), origin.provenance("observation", MEASUREMENT))
    save(passive, passive_to_dataset(baseline), origin.provenance("passive", MEASUREMENT))
    parts = {"shard-1": range(35, DRAWS), "shard-0": range(35), "whole": range(DRAWS)}
    files = {name: folder / f"{name}.h5" for name in parts}
    for name, draws in parts.items():
        made = draw_simulations(draws, context, PAPER_PRIOR, FORWARD_MODEL, 1)
        save(files[name], simulations_to_dataset(made), origin.provenance("simulations", PAPER_PRIOR))
    return Inputs((observation,), (passive,), (files["shard-1"], files["shard-0"]), (files["whole"],))


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    folder = tmp_path_factory.mktemp("cohort")
    parts = [write_subject(folder / context.subject, context) for context in CONTEXTS]
    names = ("observations", "passives", "shards", "whole_shards")
    return Inputs(*(sum((getattr(part, name) for part in parts), ()) for name in names))


@pytest.fixture(scope="module")
def results(inputs: Inputs, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    run_all(folder, inputs, inputs.shards)
    return folder


def make_pool(path: Path, inputs: Inputs, shards: Sequence[Path], settings: pool.PoolStageSettings) -> None:
    pool.run(
        observations=inputs.observations,
        passives=inputs.passives,
        shards=shards,
        pool=path,
        settings=settings,
        origin=Origin(9),
    )


def run_all(folder: Path, inputs: Inputs, shards: Sequence[Path]) -> None:
    pooled, estimator = folder / "pool.h5", folder / "estimator.pt"
    make_pool(pooled, inputs, shards, POOL)
    training = folder / "training.csv"
    train.run(
        pool=pooled, estimator=estimator, training=training, settings=TRAIN, origin=Origin(9), device="cpu"
    )
    for context in CONTEXTS:
        posterior.run(
            pool=pooled,
            estimator=estimator,
            posterior=folder / f"{context.subject}.h5",
            support=folder / f"{context.subject}.json",
            settings=POSTERIOR,
            origin=Origin(9, context.subject),
        )
    recovery.run(
        pool=pooled,
        estimator=estimator,
        passives=inputs.passives[::-1],
        observations=inputs.observations,
        recovery=folder / "recovery.csv",
        settings=RECOVERY,
        origin=Origin(9),
    )


def test_pool_holds_every_draw_augmentation_and_component(results: Path) -> None:
    data = read_pool(results / "pool.h5")
    assert data.z.shape == (2 * DRAWS * 3, 46 + 7)
    assert data.subjects == ("A", "B")
    assert data.components.features == summary_names(SUMMARY)
    raw = data.z * data.standardisation.scale + data.standardisation.mean
    noisy = np.flatnonzero([name in NOISE.feature_noise_sd for name in data.components.names])
    spread = raw.reshape(2 * DRAWS, 3, 53).std(axis=1).mean(axis=0)
    assert np.all(spread[noisy] > 0.01)
    assert np.all(np.delete(spread, noisy) < 1e-3)


def test_training_table_has_losses_and_nothing_of_the_clock(results: Path) -> None:
    frame = pd.read_csv(results / "training.csv")
    assert list(frame) == ["epoch", "training_loss", "validation_loss", "best_so_far"]
    assert list(frame["epoch"]) == list(range(1, 8))
    best, _ = load_estimator(results / "estimator.pt")
    assert frame["epoch"][frame["validation_loss"].idxmin()] == best.best_epoch
    assert frame["validation_loss"].min() == best.best_validation_loss


def test_posterior_and_support_agree(results: Path) -> None:
    for context in CONTEXTS:
        draws = read_posterior(results / f"{context.subject}.h5")
        support = read_support(results / f"{context.subject}.json")
        assert support.candidate_draws == 2000
        assert len(draws.theta) == min(300, support.in_prior_draws)
        assert support.max_abs_z == np.abs(draws.z_obs).max()
        assert draws.component_names[int(np.abs(draws.z_obs).argmax())] == support.worst_component


def test_recovery_has_a_row_for_each_parameter_and_level(results: Path) -> None:
    frame = pd.read_csv(results / "recovery.csv")
    assert list(frame) == [
        "parameter",
        "nominal",
        "coverage",
        "ci_low",
        "ci_high",
        "n",
        "bias",
        "contraction",
    ]
    assert len(frame) == 6
    assert frame["n"].between(5, 9).all()
    assert ((frame["ci_low"] <= frame["coverage"]) & (frame["coverage"] <= frame["ci_high"])).all()


def test_other_shards_and_another_run_give_the_same_bytes(
    results: Path, inputs: Inputs, tmp_path: Path
) -> None:
    run_all(tmp_path, inputs, inputs.whole_shards[::-1])
    written = sorted(path.name for path in results.iterdir())
    assert written == sorted(path.name for path in tmp_path.iterdir())
    assert len(written) == 8
    for name in written:
        assert (tmp_path / name).read_bytes() == (results / name).read_bytes(), name


def test_fewer_draws_are_the_first_of_the_same_draws(results: Path, inputs: Inputs, tmp_path: Path) -> None:
    make_pool(
        tmp_path / "pool.h5", inputs, inputs.shards, POOL.model_copy(update={"simulations_per_subject": 20})
    )
    small, full = read_pool(tmp_path / "pool.h5"), read_pool(results / "pool.h5")
    np.testing.assert_array_equal(small.theta, full.theta[full.draw_index < 20])


def test_missing_inputs_are_named(inputs: Inputs, tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="subject A: 60 simulations given, 61 wanted"):
        make_pool(
            tmp_path / "p.h5", inputs, inputs.shards, POOL.model_copy(update={"simulations_per_subject": 61})
        )
    with pytest.raises(ArtefactError, match="subject B: 0 simulations given"):
        make_pool(tmp_path / "p.h5", inputs, inputs.shards[:2], POOL)
    with pytest.raises(ArtefactError, match="each subject needs one of each"):
        make_pool(tmp_path / "p.h5", replace(inputs, passives=inputs.passives[:1]), inputs.shards, POOL)
    assert not (tmp_path / "p.h5").exists()


def test_estimator_of_other_features_is_refused(results: Path, inputs: Inputs, tmp_path: Path) -> None:
    scalars = SUMMARY.model_copy(update={"use_trajectory": False})
    make_pool(tmp_path / "pool.h5", inputs, inputs.shards, POOL.model_copy(update={"summary": scalars}))
    assert read_pool(tmp_path / "pool.h5").z.shape[1] == 16 + 7
    with pytest.raises(ArtefactError, match=r"estimator\.pt: takes the components"):
        posterior.run(
            pool=tmp_path / "pool.h5",
            estimator=results / "estimator.pt",
            posterior=tmp_path / "A.h5",
            support=tmp_path / "A.json",
            settings=POSTERIOR,
            origin=Origin(9, "A"),
        )


def test_artefacts_say_where_they_come_from(results: Path) -> None:
    _, provenance = load_estimator(results / "estimator.pt")
    assert (provenance.kind, provenance.seed) == ("estimator", 9)
    assert provenance.settings == TRAIN.to_plain()
    assert read_provenance(provenance.attributes()) == provenance
    assert json.loads((results / "A.json").read_text())["candidate_draws"] == 2000


@pytest.mark.parametrize("module", ["settings", "pool", "dataset", "posterior", "support", "recovery"])
def test_readers_do_not_import_torch(module: str) -> None:
    code = f"import sys, swesbi.inference.{module}; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

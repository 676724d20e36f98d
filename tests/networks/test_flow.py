"""The flow: fresh noise, split by theta, a normalised density in the box, files that repeat."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import speed_case
import torch
from flow_case import CONDITIONING, TINY, simulations, trained

from swesbi.artefacts import ArtefactError, Provenance
from swesbi.networks.flow.conditioning import raw_features
from swesbi.networks.flow.trained import FlowProposal, TrainedFlow, flow_proposal
from swesbi.networks.flow.training import (
    Rows,
    TrainingDivergedError,
    _Trainer,
    fit_statistics,
    make_rows,
    split_by_theta,
    train_over_subjects,
)
from swesbi.prior import bounds, in_bounds

PROVENANCE = Provenance("", "", 1, {}, "0" * 16)


def test_no_theta_is_on_both_sides_of_the_split() -> None:
    training, held_out = split_by_theta([simulations()], 0.25)
    assert not set(training[0].theta[:, 0]) & set(held_out[0].theta[:, 0])
    assert len(held_out[0].theta) == 500
    with pytest.raises(ValueError, match="validation_fraction = 0.0001"):
        split_by_theta([simulations()], 0.0001)


def test_noise_is_fresh_every_epoch_and_repeats_under_the_seed() -> None:
    conditioner, eta = fit_statistics([simulations()], CONDITIONING, 3)
    first, again, second = (
        make_rows([simulations()], conditioner, eta, 3, "epoch", number) for number in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.z, again.z)
    assert np.abs(first.z[:, :46] - second.z[:, :46]).mean() > 0.01
    np.testing.assert_array_equal(first.eta, second.eta)
    assert first.eta.shape[1] == 3  # the passive stiffness is part of the noise


def test_features_pass_the_operator_of_the_data() -> None:
    model = speed_case.model()
    raw = raw_features(model.recording.speed_m_s[None], model.recording.phase, CONDITIONING)[0]
    highest = np.log(3.0 * model.recording.speed_m_s.max() ** 2)  # kPa for rho = 1000 kg/m3
    names = CONDITIONING.components
    assert raw[names.index("maximum_kpa")] == pytest.approx(highest, abs=0.02)
    peak = model.recording.phase[model.recording.speed_m_s.argmax()]
    assert raw[names.index("time_to_peak_cycle")] == pytest.approx(peak, abs=0.05)


def test_training_learns_and_keeps_the_best_epoch() -> None:
    epochs, flow = trained().training, trained().estimator
    assert list(epochs["epoch"]) == list(range(1, TINY.epochs + 1))
    assert epochs["validation_loss"].min() == flow.best_validation_loss
    standard_normal = 1.5 * np.log(2.0 * np.pi * np.e)  # entropy of eta without any data, 3 dimensions
    assert flow.best_validation_loss < standard_normal - 2.0
    assert (epochs["skipped_batches"] == 0).all()


def test_the_weights_are_those_of_the_best_epoch_whatever_came_after() -> None:
    rng = np.random.default_rng(4)
    z = rng.standard_normal((256, 53)).astype(np.float32)
    rows, away = (Rows(rng.normal(at, 1.0, (256, 3)).astype(np.float32), z) for at in (0.0, 5.0))
    trainer = _Trainer(TINY, rows, label="test")
    trainer.run(rows, [rows])
    best = trainer.record.best_loss
    trainer.run(rows, [away])
    assert [epoch.best_so_far for epoch in trainer.record.epochs] == [True, False]
    trainer.best_net()
    assert trainer._judge(rows) == best


def known() -> FlowProposal:
    """Return what the trained flow makes of the recording."""
    return flow_proposal(trained().estimator, speed_case.model().recording)


def test_a_point_whose_map_overflows_goes_to_a_corner_of_the_box() -> None:
    prior, u = speed_case.settings().prior.simulated, np.random.default_rng(3).standard_normal((5, 3))
    far = u.copy()
    far[2] = 1e38
    plain, heart = known().at(u), known().at(far)
    assert in_bounds(heart, prior).all()
    np.testing.assert_allclose(heart[2], bounds(prior)[0], rtol=1e-9)
    np.testing.assert_array_equal(np.delete(heart, 2, axis=0), np.delete(plain, 2, axis=0))


@pytest.mark.parametrize("spread", [1.0, 2.0])
def test_draws_lie_in_the_box_and_have_the_density_that_is_claimed(spread: float) -> None:
    proposal, prior = known(), speed_case.settings().prior.simulated
    eta = proposal.flow.eta
    flow = replace(proposal, flow=replace(proposal.flow, eta=replace(eta, scale=spread * eta.scale)))
    heart = flow.draw(40_000, seed=1)
    assert in_bounds(heart, prior).all()
    other = flow.draw(40_000, seed=2)
    width = 0.3 * other.std(axis=0)
    near = np.all(np.abs(heart - np.median(heart, axis=0)) < width, axis=1)
    rng = np.random.default_rng(0)
    uniform = np.median(heart, axis=0) + width * rng.uniform(-1, 1, (20_000, 3))
    mass = np.exp(flow.log_density(uniform)).mean() * np.prod(2 * width)
    assert mass == pytest.approx(near.mean(), rel=0.15)


def test_the_draws_of_a_stiffer_recording_are_stiffer() -> None:
    recording = speed_case.model().recording
    stiffer = flow_proposal(trained().estimator, replace(recording, speed_m_s=recording.speed_m_s * 1.3))
    assert np.median(stiffer.draw(500, seed=1)[:, 0]) > 1.3 * np.median(known().draw(500, seed=1)[:, 0])


def test_files_repeat_to_the_byte_and_give_back_the_same_flow(tmp_path: Path) -> None:
    flow = trained().estimator
    again = train_over_subjects([simulations()], CONDITIONING, TINY, seed=3).estimator
    for name, part in (("one.h5", flow), ("two.h5", again)):
        part.write(tmp_path / name, PROVENANCE)
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()
    loaded = TrainedFlow.read(tmp_path / "one.h5")
    other = replace(flow, settings=TINY.model_copy(update={"hidden_features": 25}))
    other.write(tmp_path / "other.h5", PROVENANCE)
    with pytest.raises(ArtefactError, match=r"other\.h5.*weights"):
        TrainedFlow.read(tmp_path / "other.h5")
    here, there = (flow_proposal(one, speed_case.model().recording) for one in (flow, loaded))
    np.testing.assert_array_equal(here.condition, there.condition)
    np.testing.assert_array_equal(here.draw(50, 1), there.draw(50, 1))
    (tmp_path / "broken.h5").write_bytes((tmp_path / "one.h5").read_bytes()[:-500])
    with pytest.raises(ArtefactError, match=r"broken\.h5"):
        TrainedFlow.read(tmp_path / "broken.h5")


def test_a_wrong_conditioning_vector_is_refused() -> None:
    flow = trained().estimator
    with pytest.raises(ValueError, match="the flow takes 53 components"):
        FlowProposal(flow, np.zeros(5))
    with pytest.raises(ValueError, match="not finite"):
        FlowProposal(flow, np.full(53, np.nan))


def test_a_loss_that_is_not_finite_changes_no_weight_and_too_many_stop_the_training() -> None:
    trainer = _Trainer(
        TINY, Rows(np.zeros((256, 3), np.float32), np.zeros((256, 53), np.float32)), label="test"
    )
    before = {name: value.clone() for name, value in trainer._net.state_dict().items()}
    bad = torch.full((128, 53), torch.nan)
    assert not np.isfinite(trainer._step(torch.zeros(128, 3), bad))
    assert all(torch.equal(value, before[name]) for name, value in trainer._net.state_dict().items())
    with pytest.raises(TrainingDivergedError, match="lower learning_rate"):
        trainer._pass(torch.zeros(256, 3), torch.full((256, 53), torch.nan))

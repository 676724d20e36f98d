"""Valves of simulated beats close where flow ends, and move without jumps as the heart does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case

from swesbi.heart.closures import valve_closures
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.natural_waves import predict_at_closures
from swesbi.prior import draw_prior

SETTINGS = speed_case.settings().forward_model
SAMPLES = SETTINGS.samples_per_beat


def beats_of(settings: ForwardModelSettings, k_sr: np.ndarray) -> Beats:
    theta = np.column_stack([np.full(len(k_sr), 60.0), np.full(len(k_sr), 6.0), k_sr])
    return simulate(theta, speed_case.CONTEXT, settings)


@pytest.mark.parametrize("valves", ["resistive", "inertance"])
def test_a_closure_lies_between_the_last_flow_and_none(valves: str) -> None:
    settings = SETTINGS.model_copy(update={"valves": valves})
    beats = beats_of(settings, np.linspace(15.0, 50.0, 12))
    assert (beats.status == Status.PERIODIC).all()
    closures = valve_closures(beats, settings)
    for phases, flow in (
        (closures.mitral, beats.mitral_flow_ml_s),
        (closures.aortic, beats.aortic_flow_ml_s),
    ):
        before = np.floor(phases * SAMPLES - 1e-9).astype(int)
        row = np.arange(len(phases))
        assert (flow[row, before] > 0.0).all()
        assert (flow[row, (before + 1) % SAMPLES] == 0.0).all()
    assert (closures.mitral < 0.2).all()
    assert ((closures.aortic > 0.25) & (closures.aortic < 0.55)).all()


def test_closures_and_the_speeds_there_do_not_jump_from_sample_to_sample() -> None:
    """Along a line of hearts that moves both closures over two samples and more, 0.005 of the beat each.

    What holds the mitral valve open is so little that its closure passes from one sample to the next quickly,
    but not at once.
    """
    model = speed_case.model(prior="calibrated")
    phi = np.repeat(speed_case.central_phi(model)[None], 480, axis=0)
    phi[:, model.settings.prior.names.index("activation_onset_s")] = np.linspace(0.035, 0.047, 480)
    beats = model.simulate(phi)
    closures = valve_closures(beats, model.settings.forward_model)
    predicted = predict_at_closures(model, phi, beats).log_speed
    for phases, log_speed in zip((closures.mitral, closures.aortic), predicted.T, strict=True):
        assert np.ptp(phases) > 2.0 / SAMPLES
        assert np.abs(np.diff(phases)).max() < 0.2 / SAMPLES
        assert np.abs(np.diff(log_speed)).max() < 0.005


def test_a_beat_that_failed_or_never_ejects_has_no_closure() -> None:
    beats = beats_of(SETTINGS, np.array([30.0, 30.0, 30.0]))
    closed = np.zeros_like(beats.aortic_flow_ml_s[1])
    failed = np.full_like(closed, np.nan)
    aortic = np.stack([beats.aortic_flow_ml_s[0], closed, failed])
    mitral = np.stack([beats.mitral_flow_ml_s[0], beats.mitral_flow_ml_s[1], failed])
    changed = replace(beats, aortic_flow_ml_s=aortic, mitral_flow_ml_s=mitral)
    closures = valve_closures(changed, SETTINGS)
    assert np.isfinite([closures.mitral[0], closures.aortic[0]]).all()
    assert np.isnan([*closures.mitral[1:], *closures.aortic[1:]]).all()


def test_every_heart_of_the_prior_that_beats_has_closures() -> None:
    model = speed_case.model(prior="calibrated")
    beats = model.simulate(draw_prior(model.settings.prior, 60, np.random.default_rng(4)))
    closures = valve_closures(beats, model.settings.forward_model)
    works = beats.status == Status.PERIODIC
    assert np.isfinite(closures.mitral[works]).mean() > 0.95
    assert np.isfinite(closures.aortic[works]).mean() > 0.95

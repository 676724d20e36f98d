"""From simulations of one subject, prior or posterior, to predictive draws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation.predictive import Draws, Target
from swesbi.evaluation.subject_model import SubjectModel
from swesbi.forward_model.activation import attained_stiffness_kpa
from swesbi.forward_model.periodic import Status
from swesbi.inference.observation_model import noise_sd
from swesbi.inference.settings import ObservationModelSettings
from swesbi.observation.settings import SummarySettings, summary_names
from swesbi.observation.summary import summarise
from swesbi.parameters import THETA
from swesbi.simulations.draw import PriorSimulations

FloatArray = NDArray[np.float64]


class FeatureError(ValueError):
    """A feature to check that the summary does not have."""


def make_target(
    model: SubjectModel,
    feature_names: tuple[str, ...],
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
) -> Target:
    """Return what the predictions of a subject are compared with.

    Raises:
        FeatureError: A name is no feature of the summary.
    """
    observation = model.observation
    columns = feature_columns(feature_names, summary)
    sd = noise_sd(summary_names(summary), observation_model.feature_noise_sd)
    return Target(
        grid=observation.grid,
        curve_kpa=observation.curve_kpa,
        phase=observation.phase,
        measured=observation.measured,
        stiffness_kpa=observation.stiffness_kpa,
        stiffness_se_kpa=observation.stiffness_se_kpa,
        features=summarise(observation.curve_kpa[None], summary)[0, columns],
        feature_names=feature_names,
        feature_noise_sd=sd[columns],
        lvedv_ml=observation.context.lvedv_ml,
        lvesv_ml=observation.context.lvesv_ml,
    )


def from_prior(
    simulations: PriorSimulations,
    model: SubjectModel,
    feature_names: tuple[str, ...],
    summary: SummarySettings,
    number: int,
) -> Draws:
    """Return the first ``number`` stored, successful prior simulations as predictive draws."""
    volumes = (simulations.end_diastolic_volume_ml[:number], simulations.end_systolic_volume_ml[:number])
    cycles = (simulations.cycle_phase, simulations.active_stiffness_kpa[:number])
    return _measure(simulations.theta[:number], cycles, volumes, 0, model, feature_names, summary)


def from_theta(
    theta: FloatArray, model: SubjectModel, feature_names: tuple[str, ...], summary: SummarySettings
) -> Draws:
    """Simulate theta of shape (n, 3) and return the successful ones as predictive draws; n may be 0."""
    if len(theta) == 0:
        return _no_draws(model, len(feature_names))
    beats = model.simulate(theta)
    good = beats.status == Status.PERIODIC
    if not good.any():
        return _no_draws(model, len(feature_names), failed=len(theta))
    cycles = (beats.cycle_phase, beats.active_stiffness_kpa[good])
    volumes = (beats.end_diastolic_volume_ml[good], beats.end_systolic_volume_ml[good])
    failed = int((~good).sum())
    return _measure(theta[good], cycles, volumes, failed, model, feature_names, summary)


def _measure(
    theta: FloatArray,
    cycles: tuple[FloatArray, FloatArray],
    volumes_ml: tuple[FloatArray, FloatArray],
    failed: int,
    model: SubjectModel,
    feature_names: tuple[str, ...],
    summary: SummarySettings,
) -> Draws:
    curves = model.on_grid(*cycles)
    return Draws(
        theta=theta,
        curve_kpa=curves,
        phase_kpa=model.at_phases(*cycles),
        features=summarise(curves, summary)[:, feature_columns(feature_names, summary)],
        end_diastolic_volume_ml=volumes_ml[0],
        end_systolic_volume_ml=volumes_ml[1],
        attained_stiffness_kpa=attained_stiffness_kpa(theta, model.activation_duration_s),
        failed=failed,
    )


def _no_draws(model: SubjectModel, features: int, failed: int = 0) -> Draws:
    return Draws(
        theta=np.empty((0, len(THETA))),
        curve_kpa=np.empty((0, model.measurement.grid_points)),
        phase_kpa=np.empty((0, len(model.observation.phase))),
        features=np.empty((0, features)),
        end_diastolic_volume_ml=np.empty(0),
        end_systolic_volume_ml=np.empty(0),
        attained_stiffness_kpa=np.empty(0),
        failed=failed,
    )


def feature_columns(feature_names: tuple[str, ...], summary: SummarySettings) -> list[int]:
    """Return where the named features stand in the summary.

    Raises:
        FeatureError: A name is no feature of the summary.
    """
    names = summary_names(summary)
    if unknown := [name for name in feature_names if name not in names]:
        raise FeatureError(
            f"predictive.features: {unknown[0]!r} is no feature of the summary; it has {', '.join(names)}"
        )
    return [names.index(name) for name in feature_names]

"""The conditioning vector z of a flow of known subjects: features S(.) of speeds, and context."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Settings
from swesbi.context import CONTEXT_NAMES, Context
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.settings import SummarySettings, summary_names, summary_units
from swesbi.measurement.speeds import SpeedRecording
from swesbi.measurement.summary import summarise
from swesbi.networks.standardisation import Standardisation, fit_standardisation
from swesbi.recording.phases import to_grid
from swesbi.recording.speed import youngs_modulus_kpa

LEAST_KPA: Final = 1e-3  # a flat curve has no amplitude and no slope, hence no logarithm of them
LARGEST_Z: Final = 8.0  # what lies farther out is judged by the misspecification tests, not by the network


class ConditioningSettings(Settings):
    """How measured speeds become features."""

    summary: SummarySettings
    grid_points: int
    density_kg_m3: float

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z: features, then context."""
        return (*summary_names(self.summary), *CONTEXT_NAMES)


def conditioning_of(summary: SummarySettings, model: SpeedModelSettings) -> ConditioningSettings:
    """Return how the speeds of a model's recordings become the features of a summary."""
    return ConditioningSettings(
        summary=summary, grid_points=model.measurement.grid_points, density_kg_m3=model.density_kg_m3
    )


def raw_features(speed_m_s: FloatArray, phase: FloatArray, settings: ConditioningSettings) -> FloatArray:
    """Return the features of recordings as the flow sees them, before standardisation; shape (n, F).

    The speeds pass the same operator as the data: E = 3 rho c^2, the periodic interpolant, S(.). What is
    a stiffness, an area or a slope enters by the logarithm of its size, since its noise is proportional.
    Speeds are (n, p) at the measured phases (p,).
    """
    stiffness = youngs_modulus_kpa(speed_m_s, settings.density_kg_m3)
    features = summarise(to_grid(phase, stiffness, settings.grid_points), settings.summary)
    positive = np.array(summary_units(settings.summary)) == "kPa"
    features[:, positive] = np.log(np.maximum(np.abs(features[:, positive]), LEAST_KPA))
    return features


@dataclass(frozen=True)
class Conditioner:
    """Makes conditioning vectors of C components, with the statistics of the training split."""

    settings: ConditioningSettings
    features: Standardisation  # F features over the training rows
    context: Standardisation  # 7 values over the subjects trained on

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z."""
        return self.settings.components

    def condition(self, recording: SpeedRecording) -> FloatArray:
        """Return z of one recording; shape (C,)."""
        raw = raw_features(recording.speed_m_s[None], recording.phase, self.settings)
        return np.asarray(self.standardise(raw, recording.context)[0])

    def standardise(self, raw: FloatArray, context: Context) -> FloatArray:
        """Standardise raw features (n, F), within bounds, and put the context behind them; shape (n, C)."""
        features = np.clip(self.features.apply(raw), -LARGEST_Z, LARGEST_Z)
        values = self.context.apply(context.as_array())
        return np.hstack([features, np.broadcast_to(values, (len(raw), len(values)))])


def fit_conditioner(
    raw: FloatArray, contexts: tuple[Context, ...], settings: ConditioningSettings
) -> Conditioner:
    """Take the statistics of raw training features (n, F) and of the subjects' contexts."""
    values = np.stack([context.as_array() for context in contexts])
    return Conditioner(settings, fit_standardisation(raw), fit_standardisation(values))

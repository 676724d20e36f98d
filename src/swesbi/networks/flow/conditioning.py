"""The conditioning vector z of a flow: what the network sees of a recording.

Of known subjects it is features S(.) of the speeds at their phases, and context. A network over a population
sees a set of points in the cells of the cycle.

Such a recording is a set of points (instant s_i, log speed, standard error se_i), two or sixty, anywhere in
the cycle, gated or not. The network takes as many numbers whatever the set: of each of P equal parts of the
cycle the mean log speed of its points, the error of that mean, the mean instant, all weighted by se_i^-2, and
whether there is any. These sums do not depend on the order of the points, and within a cell, where a
curve is nearly a line and what the model misses is one, they are nearly all that the points say. A gated
recording of P phases has one point in each, at its centre.

The standard error of a gated phase is the total one. Where phases share errors the network learns from
recordings that do, but does not know how much of a standard error is shared; the exact weights, whose
likelihood knows, make up for it, as they do for what is lost within a cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from pydantic import Field

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.base.settings import Settings
from swesbi.context import CONTEXT_NAMES, CONTEXT_RANGES, Context
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.settings import SummarySettings, summary_names, summary_units
from swesbi.measurement.speeds import SpeedRecording
from swesbi.measurement.summary import summarise
from swesbi.networks.files import Standardisation, fit_standardisation
from swesbi.recording.phases import cells_of, nominal_phases, to_grid
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
    inputs: Standardisation  # F features over the training rows, then 7 values over the subjects trained on

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
        of_context = np.broadcast_to(context.as_array(), (len(raw), len(CONTEXT_NAMES)))
        z = self.inputs.apply(np.hstack([raw, of_context]))
        features = slice(raw.shape[1])
        z[:, features] = np.clip(z[:, features], -LARGEST_Z, LARGEST_Z)
        return z


def fit_conditioner(
    raw: FloatArray, contexts: tuple[Context, ...], settings: ConditioningSettings
) -> Conditioner:
    """Take the statistics of raw training features (n, F) and of the subjects' contexts."""
    values = np.stack([context.as_array() for context in contexts])
    features, context = fit_standardisation(raw), fit_standardisation(values)
    inputs = Standardisation(
        np.concatenate([features.mean, context.mean]), np.concatenate([features.scale, context.scale])
    )
    return Conditioner(settings, inputs)


CONTEXT_INPUTS: Final = tuple(CONTEXT_RANGES)
"""What the simulator takes of a context; nothing else can change a posterior."""
IN_CELLS: Final = ("log_speed", "missing", "log_relative_se", "offset")
FACTOR: Final = "errors_log_sd"


class CellSettings(Settings):
    """The cells in which the network sees a recording, and the noise that it was trained on."""

    cells: int = Field(ge=6, le=400, description="equal parts of the cycle")
    relative_se: tuple[float, float] = Field(description="standard errors of a cell's mean, over the speed")

    @property
    def centre(self) -> FloatArray:
        """Centres of the cells, the phases of a gated recording of as many; shape (P,)."""
        return nominal_phases(self.cells)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z."""
        return (
            *(f"log_{name}" for name in CONTEXT_INPUTS),
            *(f"{part}_cell_{index:02d}" for part in IN_CELLS for index in range(self.cells)),
            FACTOR,
        )


@dataclass(frozen=True)
class PooledPoints:
    """Points of n recordings, gathered in the P cells of each; arrays of shape (n, P)."""

    measured: BoolArray  # which cells hold a point
    relative_se: FloatArray  # of the weighted mean, 1 where there is none
    offset: FloatArray  # weighted mean instant less the centre of its cell, in widths of a cell
    _cell: IntArray
    _weight: FloatArray

    def mean(self, values: FloatArray) -> FloatArray:
        """Return the weighted mean in each cell of values of the points, (N,); 0 where none is; (n, P)."""
        return _mean(self._cell, self._weight, values, self.measured)


def pool_points(
    row: IntArray, phase: FloatArray, relative_se: FloatArray, n: int, cells: int
) -> PooledPoints:
    """Gather N points of n recordings in their cells: ``row`` is the number of each point's recording."""
    within = cells_of(phase, cells)
    cell, weight = row * cells + within, relative_se**-2.0
    total = np.bincount(cell, weight, minlength=n * cells).reshape(n, cells)
    measured = total > 0.0
    offset = _mean(cell, weight, phase * cells - within - 0.5, measured)
    se = np.where(measured, total, 1.0) ** -0.5
    return PooledPoints(measured, se, offset, cell, weight)


def _mean(cell: IntArray, weight: FloatArray, values: FloatArray, measured: BoolArray) -> FloatArray:
    shape = measured.shape
    sums = [np.bincount(cell, w, minlength=measured.size).reshape(shape) for w in (weight * values, weight)]
    return np.asarray(np.divide(sums[0], sums[1], out=np.zeros(shape), where=measured))


@dataclass(frozen=True)
class SeenCells:
    """What is seen of n recordings in their P cells, (n, P); anything where not measured."""

    log_speed: FloatArray
    measured: BoolArray  # at least one cell a recording
    relative_se: FloatArray  # positive
    offset: FloatArray  # mean instant less the centre, in widths of a cell
    errors_log_sd: FloatArray  # of the log of a factor of all errors, 0 where they are known; (n,)


def context_inputs(context: Context) -> FloatArray:
    """Return the logarithms of heart rate, end-diastolic volume and septal thickness; shape (3,)."""
    return np.log([getattr(context, name) for name in CONTEXT_INPUTS])


def cell_inputs(context: FloatArray, seen: SeenCells, settings: CellSettings) -> FloatArray:
    """Return what the network takes of n recordings, before standardisation; shape (n, C).

    ``context`` (n, 3) is :func:`context_inputs` of each. Standard errors are clipped to the settings' range.
    """
    low, high = settings.relative_se
    measured = seen.measured
    log_se = np.log(np.clip(np.where(measured, seen.relative_se, np.sqrt(low * high)), low, high))
    offset = np.where(measured, seen.offset, 0.0)
    filled = fill_missing(seen.log_speed, measured)
    return np.hstack([context, filled, ~measured, log_se, offset, seen.errors_log_sd[:, None]])


def fill_missing(values: FloatArray, measured: BoolArray) -> FloatArray:
    """Put the line between the measured neighbours, around the cycle, where nothing was measured; (n, P)."""
    before, after = _neighbours(measured, -1), _neighbours(measured, 1)
    index = np.arange(values.shape[1])
    to_before, to_after = (index - before) % values.shape[1], (after - index) % values.shape[1]
    low, high = (np.take_along_axis(values, at, axis=1) for at in (before, after))
    span = np.maximum(to_before + to_after, 1)
    return np.where(measured, values, (low * to_after + high * to_before) / span)


def _neighbours(measured: BoolArray, direction: int) -> IntArray:
    """Return the index of the next measured cell in a direction around the cycle, its own if measured."""
    cells = measured.shape[1]
    turned = measured[:, ::-direction]
    twice = np.concatenate([turned, turned], axis=1)
    position = np.where(twice, np.arange(2 * cells), -1)
    latest = np.maximum.accumulate(position, axis=1)[:, cells:] % cells
    return np.asarray(latest if direction < 0 else cells - 1 - latest[:, ::-1])


def recording_inputs(recording: SpeedRecording, settings: CellSettings) -> FloatArray:
    """Return what the network takes of one recording, gated or of pushes, before standardisation; (1, C)."""
    row = np.zeros(len(recording.phase), dtype=np.int64)
    pooled = pool_points(row, recording.phase, recording.errors.total, 1, settings.cells)
    speed = pooled.mean(np.log(recording.speed_m_s))
    factor = np.array([recording.errors_log_sd])
    seen = SeenCells(speed, pooled.measured, pooled.relative_se, pooled.offset, factor)
    return cell_inputs(context_inputs(recording.context)[None], seen, settings)


@dataclass(frozen=True)
class CellConditioner:
    """Makes conditioning vectors of C components, with the statistics of the training rows."""

    settings: CellSettings
    inputs: Standardisation

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z."""
        return self.settings.components

    def condition(self, recording: SpeedRecording) -> FloatArray:
        """Return z of one recording, whatever its instants; shape (C,)."""
        return np.asarray(self.standardise(recording_inputs(recording, self.settings))[0])

    def standardise(self, inputs: FloatArray) -> FloatArray:
        """Standardise inputs (n, C), within bounds."""
        return np.clip(self.inputs.apply(inputs), -LARGEST_Z, LARGEST_Z)


AnyConditioner = Conditioner | CellConditioner
"""What makes the conditioning vector of a recording."""

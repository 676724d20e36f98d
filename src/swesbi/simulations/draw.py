"""Successful simulations from the prior, with failures counted by reason and redrawn.

Draw number i of a subject has a random stream of its own, so its theta depends on the study's seed,
the prior, the subject and i alone: neither the shards nor the cores nor the order of jobs matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Variable
from swesbi.context import Context
from swesbi.forward_model.beats import Beats
from swesbi.forward_model.periodic import Status
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.forward_model.simulate import simulate
from swesbi.parameters import THETA, THETA_COLUMNS
from swesbi.prior import PriorSettings, quantile
from swesbi.seeds import generator

FloatArray = NDArray[np.float64]
MAXIMUM_ATTEMPTS = 100


class SimulationFailure(RuntimeError):
    """A draw that found no periodic beat within the permitted attempts."""


@dataclass(frozen=True)
class PriorSimulations:
    """n successful simulations of one subject; one attempt means that none failed."""

    draw_index: Annotated[
        NDArray[np.int64], Variable("simulation", "1", "number of the draw within the subject")
    ]
    theta: Annotated[FloatArray, Variable("simulation parameter", THETA_COLUMNS, "active parameters")]
    attempts: Annotated[
        NDArray[np.int64], Variable("simulation", "1", "theta drawn until a simulation succeeded")
    ]
    failures: Annotated[NDArray[np.int64], Variable("simulation status", "1", "failed attempts by status")]
    cycle_phase: Annotated[FloatArray, Variable("cycle", "1", "fraction of the cycle from the R peak")]
    active_stiffness_kpa: Annotated[FloatArray, Variable("simulation cycle", "kPa", "active stiffness k_c")]
    end_diastolic_volume_ml: Annotated[FloatArray, Variable("simulation", "mL", "largest cavity volume")]
    end_systolic_volume_ml: Annotated[FloatArray, Variable("simulation", "mL", "smallest cavity volume")]
    beats: Annotated[NDArray[np.int64], Variable("simulation", "1", "beats until periodic")]


@dataclass(frozen=True)
class _Round:
    """One attempt at the draws still pending: the rows that succeeded, and which of its beats they are."""

    rows: NDArray[np.int64]
    good: NDArray[np.bool_]
    beats: Beats


def draw_simulations(
    draw_index: Sequence[int],
    context: Context,
    prior: PriorSettings,
    forward_model: ForwardModelSettings,
    seed: int,
) -> PriorSimulations:
    """Simulate the numbered draws of one subject's prior, redrawing each until it succeeds.

    Raises:
        SimulationFailure: A draw failed ``MAXIMUM_ATTEMPTS`` times.
    """
    streams = [generator(seed, "prior", context.subject, int(index)) for index in draw_index]
    theta = np.empty((len(streams), len(THETA)))
    failures = np.zeros((len(streams), len(Status)), dtype=np.int64)
    pending = np.arange(len(streams))
    rounds: list[_Round] = []
    while pending.size:
        theta[pending] = quantile(np.stack([streams[i].random(len(THETA)) for i in pending]), prior)
        beats = simulate(theta[pending], context, forward_model)
        good = beats.status == Status.PERIODIC
        rounds.append(_Round(pending[good], good, beats))
        np.add.at(failures, (pending[~good], beats.status[~good]), 1)
        pending = pending[~good]
        _check_attempts(failures, context.subject, theta)
    return _gather(np.asarray(draw_index, dtype=np.int64), theta, failures, rounds)


def _check_attempts(failures: NDArray[np.int64], subject: str, theta: FloatArray) -> None:
    worst = int(np.argmax(failures.sum(axis=1)))
    if failures[worst].sum() < MAXIMUM_ATTEMPTS:
        return
    reasons = {
        status.name.lower(): int(failures[worst, status]) for status in Status if failures[worst, status]
    }
    raise SimulationFailure(
        f"subject {subject}: {MAXIMUM_ATTEMPTS} draws in a row gave no periodic beat ({reasons}); "
        f"the last theta was {theta[worst].tolist()}. "
        "Narrow the prior's bounds or check the subject's context."
    )


def _gather(
    draw_index: NDArray[np.int64],
    theta: FloatArray,
    failures: NDArray[np.int64],
    rounds: list[_Round],
) -> PriorSimulations:
    """Put the successful beats of all rounds back into the order of the draws."""
    order = np.argsort(np.concatenate([part.rows for part in rounds]))

    def in_order(name: str) -> FloatArray:
        gathered: FloatArray = np.concatenate([getattr(part.beats, name)[part.good] for part in rounds])[
            order
        ]
        return gathered

    return PriorSimulations(
        draw_index=draw_index,
        theta=theta,
        attempts=1 + failures.sum(axis=1),
        failures=failures,
        cycle_phase=rounds[0].beats.cycle_phase,
        active_stiffness_kpa=in_order("active_stiffness_kpa"),
        end_diastolic_volume_ml=in_order("end_diastolic_volume_ml"),
        end_systolic_volume_ml=in_order("end_systolic_volume_ml"),
        beats=in_order("beats").astype(np.int64),
    )

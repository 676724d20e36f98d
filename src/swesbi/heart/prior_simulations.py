"""Simulations from the prior: what the network learns from. Failures are counted by reason and redrawn.

Draw number i of a subject has a random stream of its own, so its theta, and its physiology where the prior
frees any, depend on the study's seed, the prior, the subject and i alone: neither the shards nor the cores
nor the order of jobs matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Final

import numpy as np

from swesbi.artefacts import Artefact, ArtefactError, Labels, UnfitError, Variable
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.base.progress import LOGGER
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.physiology import Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.parameters import NUISANCE_COLUMNS, THETA, THETA_COLUMNS, THETA_NAMES
from swesbi.prior import PriorSettings, SimulatedPrior, quantile
from swesbi.seeds import generator

MAXIMUM_ATTEMPTS = 100
SHARED: Final = ("cycle_phase", "nuisance_names")
"""What has no row for each simulation."""
LABELS: Final = {"parameter": list(THETA_NAMES), "status": [status.name.lower() for status in Status]}


class SimulationFailure(RuntimeError):
    """A draw that found no periodic beat within the permitted attempts."""


@dataclass(frozen=True)
class PriorSimulations(Artefact, kind="simulations"):
    """n successful simulations of one subject; one attempt means that none failed."""

    draw_index: Annotated[IntArray, Variable("simulation", "1", "number of the draw within the subject")]
    theta: Annotated[FloatArray, Variable("simulation parameter", THETA_COLUMNS, "active parameters")]
    physiology: Annotated[
        FloatArray, Variable("simulation nuisance", NUISANCE_COLUMNS, "free physiology of the simulation")
    ]
    nuisance_names: Annotated[tuple[str, ...], Labels("nuisance")]
    attempts: Annotated[IntArray, Variable("simulation", "1", "theta drawn until a simulation succeeded")]
    failures: Annotated[IntArray, Variable("simulation status", "1", "failed attempts by status")]
    cycle_phase: Annotated[FloatArray, Variable("cycle", "1", "fraction of the cycle from the R peak")]
    active_stiffness_kpa: Annotated[FloatArray, Variable("simulation cycle", "kPa", "active stiffness k_c")]
    stretch: Annotated[FloatArray, Variable("simulation cycle", "1", "wall stretch")]
    end_diastolic_volume_ml: Annotated[FloatArray, Variable("simulation", "mL", "largest cavity volume")]
    end_systolic_volume_ml: Annotated[FloatArray, Variable("simulation", "mL", "smallest cavity volume")]
    beats: Annotated[IntArray, Variable("simulation", "1", "beats until periodic")]

    labels = LABELS

    @classmethod
    def joined(cls, parts: Sequence[PriorSimulations]) -> PriorSimulations:
        """Return the shards of one subject together, in the order of the draws whatever that of the files.

        A draw that is missing or doubled, or shards of different simulations, are an ArtefactError.
        """
        if any(
            one.nuisance_names != parts[0].nuisance_names
            or not np.array_equal(one.cycle_phase, parts[0].cycle_phase)
            for one in parts
        ):
            raise ArtefactError("shards of different simulations are given as one; delete them and rerun")
        draws = np.concatenate([one.draw_index for one in parts])
        order = np.argsort(draws)
        if not np.array_equal(draws[order], np.arange(len(draws))):
            raise ArtefactError("draws are missing or doubled; delete these shards and rerun")
        whole: dict[str, Any] = {
            name: np.concatenate([getattr(one, name) for one in parts])[order] for name in OF_EACH
        }
        return replace(parts[0], **whole)


OF_EACH: Final = tuple(field.name for field in fields(PriorSimulations) if field.name not in SHARED)
"""What has a row for each simulation."""


def first_of(shards: Mapping[str, PriorSimulations], subject: str, number: int) -> PriorSimulations:
    """Return the first draws of a subject; UnfitError where there are fewer."""
    whole = shards[subject]
    if (given := len(whole.theta)) < number:
        raise UnfitError(
            "shards",
            f"hold {given} simulations of subject {subject}, {number} are wanted; simulate it first",
        )
    rows: dict[str, Any] = {name: getattr(whole, name)[:number] for name in OF_EACH}
    return replace(whole, **rows)


def shard_of_prior(
    *,
    context: Context,
    prior: PriorSettings,
    forward_model: ForwardModelSettings,
    draw_numbers: tuple[int, int],
    seed: int,
) -> PriorSimulations:
    """Simulate the draws of a subject's prior from the first number to before the second.

    Raises:
        SimulationFailure: A draw failed ``MAXIMUM_ATTEMPTS`` times.
    """
    simulations = draw_simulations(range(*draw_numbers), context, prior, forward_model, seed)
    LOGGER.info(
        "subject %s: %d simulations, %d failed attempts redrawn",
        context.subject,
        len(simulations.theta),
        int(simulations.failures.sum()),
    )
    return simulations


def draw_simulations(
    draw_index: Sequence[int],
    context: Context,
    prior: PriorSettings,
    forward_model: ForwardModelSettings,
    seed: int,
) -> PriorSimulations:
    """Simulate the numbered draws of one subject's prior, redrawing each until it succeeds.

    A draw that failed ``MAXIMUM_ATTEMPTS`` times is a SimulationFailure.
    """
    streams = [generator(seed, "prior", context.subject, int(index)) for index in draw_index]
    simulated = SimulatedPrior(theta=prior)
    drawn = np.empty((len(streams), len(simulated.parameters)))
    failures = np.zeros((len(streams), len(Status)), dtype=np.int64)
    pending = np.arange(len(streams))
    found: list[tuple[IntArray, Beats]] = []
    """The rows that succeeded at each attempt, and their beats."""
    while pending.size:
        uniform = np.stack([streams[i].random(len(simulated.parameters)) for i in pending])
        drawn[pending] = quantile(uniform, simulated)
        theta, physiology = np.split(drawn[pending], [len(THETA)], axis=1)
        own = Physiology.of_nuisances(physiology, prior.physiology_names, forward_model)
        beats = simulate(theta, context, forward_model, own)
        good = beats.status == Status.PERIODIC
        found.append((pending[good], beats.rows(np.flatnonzero(good))))
        np.add.at(failures, (pending[~good], beats.status[~good]), 1)
        pending = pending[~good]
        _check_attempts(failures, context.subject, drawn)
    names = prior.physiology_names
    return _gather(np.asarray(draw_index, dtype=np.int64), drawn, names, failures, found)


def _check_attempts(failures: IntArray, subject: str, drawn: FloatArray) -> None:
    worst = int(np.argmax(failures.sum(axis=1)))
    if failures[worst].sum() < MAXIMUM_ATTEMPTS:
        return
    count = failures[worst]
    reasons = {status.name.lower(): int(count[status]) for status in Status if count[status]}
    raise SimulationFailure(
        f"subject {subject}: {MAXIMUM_ATTEMPTS} draws in a row gave no periodic beat ({reasons}); "
        f"the last theta was {drawn[worst, : len(THETA)].tolist()}. "
        "Narrow the prior's bounds or check the subject's context."
    )


def _gather(
    draw_index: IntArray,
    drawn: FloatArray,
    nuisance_names: tuple[str, ...],
    failures: IntArray,
    found: list[tuple[IntArray, Beats]],
) -> PriorSimulations:
    """Put the successful beats of all rounds back into the order of the draws."""
    order = np.argsort(np.concatenate([rows for rows, _ in found]))

    def in_order(name: str) -> FloatArray:
        return np.concatenate([getattr(beats, name) for _, beats in found])[order]

    return PriorSimulations(
        draw_index=draw_index,
        theta=drawn[:, : len(THETA)],
        physiology=drawn[:, len(THETA) :],
        nuisance_names=nuisance_names,
        attempts=1 + failures.sum(axis=1),
        failures=failures,
        cycle_phase=found[0][1].cycle_phase,
        active_stiffness_kpa=in_order("active_stiffness_kpa"),
        stretch=in_order("stretch"),
        end_diastolic_volume_ml=in_order("end_diastolic_volume_ml"),
        end_systolic_volume_ml=in_order("end_systolic_volume_ml"),
        beats=in_order("beats").astype(np.int64),
    )

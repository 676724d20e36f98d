"""Structures of the ladder on the speed model of the tests, and results that are made up."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import speed_case

from studies.ladder.infer import Rung
from studies.ladder.posteriors import (
    CHANGED,
    CHOSEN,
    SHIPPED,
    LadderPosterior,
    PairEvidence,
    StructureResult,
)
from studies.ladder.quantities import QUANTITIES
from studies.ladder.settings import LadderEffort, LadderSettings
from swesbi.base.arrays import FloatArray
from swesbi.config.read import parse_section, read_yaml
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.posterior.fitted import FittedProposal
from swesbi.posterior.settings import ExactSettings, asking
from swesbi.posterior.space import LogitSpace
from swesbi.posterior.student import StudentProposal
from swesbi.prior import SimulatedPrior, log_centre, to_logit

SEED: Final = 5
LADDER_CONFIG: Final = read_yaml(Path(__file__).parents[1] / "config.yaml")["ladder"]
LADDER: Final = parse_section(LADDER_CONFIG, "ladder", LadderSettings)
LEVELS: Final = np.linspace(0.0, 1.0, 2001)
EFFORT: Final = LadderEffort(
    speed_fractions=(0.01, 0.03),
    timing_cycles=(0.015,),
    simulations_per_round=500,
    max_rounds=5,
    min_effective_draws=200,
    change={"k0_kpa": 1.25, "k_sr_per_s": 0.8},
)
QUICK: Final = EFFORT.model_copy(update={"simulations_per_round": 100, "max_rounds": 2})
PAIRS: Final = tuple(
    DiscrepancySettings(speed_fraction=delta, timing_cycle=0.015) for delta in (0.02, 0.01, 0.03)
)


def exact() -> ExactSettings:
    """Return the shipped sizes of exact posteriors, a few times smaller."""
    shipped = speed_case.shipped().speed_experiments["calibrated"].exact
    return asking(shipped, 300).model_copy(update={"draws": 1000})


def wide_proposal(prior: SimulatedPrior) -> FittedProposal:
    """Return a wide Student distribution in the logit of the prior's box, about the prior's centre."""
    centre = to_logit(log_centre(prior), prior)
    return FittedProposal(StudentProposal(centre, np.eye(len(centre))), LogitSpace(prior))


def rung(prior: SimulatedPrior, settings: ExactSettings | None = None) -> Rung:
    def first(_: SpeedRecording) -> FittedProposal:
        return wide_proposal(prior)

    return Rung(first, settings or exact(), EFFORT, SEED)


def posterior(
    subject: str, answer: str, centre: FloatArray, log_evidence: float = 0.0, se: float = 0.0
) -> LadderPosterior:
    """A uniform posterior: every quantity within a tenth of its centre, in one order or the other."""
    levels = LEVELS if answer != CHANGED else LEVELS[::-1]
    values = centre * (1.0 + 0.2 * (levels[:, None] - 0.5))
    return LadderPosterior(
        subject, answer, values, 0.02, 0.015, log_evidence, se,
        by_mcmc=False, k_hat=0.1, efficiency=0.8, converged=True,
    )  # fmt: skip


def result(
    subjects: Sequence[str] = ("A", "B"), factor: float = 1.0, log_evidence: float = 0.0, se: float = 0.0
) -> StructureResult:
    """A structure that moves k_0, and nothing else, by a factor; a second recording has a quarter more."""
    centre = np.full(len(QUANTITIES), 10.0)
    centre[0] *= factor
    parts = [
        posterior(subject, answer, centre * (1.25 if answer == CHANGED else 1.0), log_evidence, se)
        for subject in subjects
        for answer in (SHIPPED, CHANGED, CHOSEN)
    ]
    evidence = [
        PairEvidence(subject, np.array([0.0, 2.0, -1.0]) + log_evidence, np.full(3, 0.1), np.full(3, 500.0))
        for subject in subjects
    ]
    return StructureResult(tuple(parts), tuple(evidence), PAIRS)

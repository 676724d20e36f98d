"""Posteriors and evidence under one structure, and the file that holds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import xarray as xr

from studies.ladder.quantities import QUANTITIES, QUANTITY_UNITS
from swesbi.artefacts import Variable, build_dataset, from_rows, load, register, schema_of, stacked_values
from swesbi.base.arrays import FloatArray
from swesbi.measurement.settings import DiscrepancySettings

SHIPPED: Final = "shipped"
CHOSEN: Final = "evidence"
CHANGED: Final = "changed"
"""Answers: at the shipped pair (delta, tau), at that of largest total evidence, of the second recording."""


@dataclass(frozen=True)
class LadderPosterior:
    """Draws of one subject's quantities under a structure, its evidence, and how they were obtained."""

    subject: Annotated[str, Variable("", "1", "name of the subject")]
    answer: Annotated[str, Variable("", "1", "shipped, evidence or changed")]
    values: Annotated[FloatArray, Variable("draw quantity", QUANTITY_UNITS, "posterior draws")]
    speed_fraction: Annotated[float, Variable("", "1", "delta of the likelihood")]
    timing_cycle: Annotated[float, Variable("", "1", "tau of the likelihood")]
    log_evidence: Annotated[float, Variable("", "1", "log evidence of the log speeds, from the weights")]
    log_evidence_se: Annotated[float, Variable("", "1", "its Monte Carlo standard error")]
    by_mcmc: Annotated[bool, Variable("", "1", "1 by MCMC, 0 by importance weights")]
    k_hat: Annotated[float, Variable("", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[float, Variable("", "1", "effective share of the weighted draws")]
    converged: Annotated[bool, Variable("", "1", "1 where the draws are reliable")]

    @property
    def sampler(self) -> str:
        """What gave the draws: ``mcmc`` or ``importance``."""
        return "mcmc" if self.by_mcmc else "importance"


@dataclass(frozen=True)
class PairEvidence:
    """Evidence of one subject's recording at each of K pairs (delta, tau); shape (K,) each."""

    subject: Annotated[str, Variable("", "1", "name of the subject")]
    log_evidence: Annotated[FloatArray, Variable("pair", "1", "log evidence of the log speeds")]
    log_evidence_se: Annotated[FloatArray, Variable("pair", "1", "its Monte Carlo standard error")]
    effective_draws: Annotated[FloatArray, Variable("pair", "1", "effective draws behind it")]


@dataclass(frozen=True)
class StructureResult:
    """All that one structure gave: posteriors, evidence by subject and pair, and the pairs."""

    posteriors: tuple[LadderPosterior, ...]
    evidence: tuple[PairEvidence, ...]
    pairs: tuple[DiscrepancySettings, ...]

    def answers(self, answer: str) -> dict[str, LadderPosterior]:
        """Return the posteriors of one answer by subject."""
        return {one.subject: one for one in self.posteriors if one.answer == answer}


PAIRS: Final = "pairs"
SCHEMA: Final = {
    "/": schema_of(LadderPosterior, along="posterior")["/"],
    PAIRS: schema_of(PairEvidence, along="recording")["/"]
    | {
        "speed_fraction": Variable("pair", "1", "delta of the pair"),
        "timing_cycle": Variable("pair", "1", "tau of the pair"),
    },
}
KIND: Final = register("ladder", SCHEMA, ("quantity",))


def to_groups(result: StructureResult) -> dict[str, xr.Dataset]:
    """Return the groups of the file of one structure."""
    labels = {"quantity": [quantity.name for quantity in QUANTITIES]}
    pairs = stacked_values(result.evidence)["/"] | {
        name: np.array([getattr(pair, name) for pair in result.pairs])
        for name in ("speed_fraction", "timing_cycle")
    }
    return {
        "/": build_dataset(SCHEMA["/"], stacked_values(result.posteriors)["/"], labels),
        PAIRS: build_dataset(SCHEMA[PAIRS], pairs),
    }


def read_structure(path: Path) -> StructureResult:
    """Read what one structure gave.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    root, pairs = load(path, KIND)[0], load(path, KIND, PAIRS)[0]
    grid = zip(pairs["speed_fraction"].to_numpy(), pairs["timing_cycle"].to_numpy(), strict=True)
    return StructureResult(
        posteriors=tuple(from_rows(LadderPosterior, root, "posterior")),
        evidence=tuple(from_rows(PairEvidence, pairs, "recording")),
        pairs=tuple(
            DiscrepancySettings(speed_fraction=float(delta), timing_cycle=float(tau)) for delta, tau in grid
        ),
    )


def check_same_subjects(results: Sequence[StructureResult]) -> None:
    """Check that every structure has the same subjects.

    Raises:
        ValueError: One has others.
    """
    subjects = [tuple(sorted(result.answers(SHIPPED))) for result in results]
    if len(set(subjects)) > 1:
        raise ValueError(f"structures with other subjects: {sorted(set(subjects))}; make them anew")

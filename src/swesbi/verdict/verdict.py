"""What is said of one subject, and the file that keeps it: ``verdict.json``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts import ArtefactError, Provenance, write_json


class Status(StrEnum):
    """The outcome in a word, as files and figures print it: of a kind of experiment, from good to bad.

    A recording is uninformative if it leaves every quantity as the prior has it, and nothing speaks against
    the model.
    """

    NOT_CONTRADICTED = "not contradicted"
    UNINFORMATIVE = "uninformative"
    DOUBTFUL = "doubtful"
    CONTRADICTED = "contradicted"
    PRIOR_SUPPORTED = "prior-supported"
    NOT_PRIOR_SUPPORTED = "not prior-supported"

    @property
    def fits(self) -> bool:
        """Whether it is of a recording on measured speeds against which no test speaks."""
        return self in {Status.NOT_CONTRADICTED, Status.UNINFORMATIVE}


PAPER_STATUSES: Final = (Status.PRIOR_SUPPORTED, Status.NOT_PRIOR_SUPPORTED)
"""Of experiments with noise on features, by the criterion of the paper."""
STATUSES: Final = tuple(status for status in Status if status not in PAPER_STATUSES)
"""Of experiments on measured speeds, from good to bad."""
GRADES: Final = (Status.NOT_CONTRADICTED, Status.DOUBTFUL, Status.CONTRADICTED)
"""What tests alone make of a recording, by the integers of ``nulls.Grade``."""


@dataclass(frozen=True)
class VerdictTest:
    """The outcome of one test of an experiment on measured speeds; flagged, it contradicts the subject.

    The p-value is None of a test without a null distribution. The threshold is of the p-value, at or below
    which the test is flagged; else of the statistic's size.
    """

    name: str
    statistic: float
    p_value: float | None
    threshold: float
    flagged: bool
    detail: str


@dataclass(frozen=True)
class Verdict:
    """The verdict on one subject.

    An experiment with noise on features judges by both criteria of the paper and leaves the last fields
    empty; one on measured speeds judges by its misspecification tests and fills them. ``worst_component``
    attains the largest |z_obs,j|; ``unfiltered_median`` is of all candidates, by parameter. ``k_hat`` and
    ``efficiency`` are of the importance weights; ``sampler`` is "importance" or "mcmc". ``answer`` has, by
    name, median, limits of the credible interval, its mass and the unit.
    """

    max_abs_z: float
    worst_component: str
    in_prior_draws: int
    candidate_draws: int
    unfiltered_median: dict[str, float]
    status: Status
    sentence: str
    reasons: tuple[str, ...]
    tests: tuple[VerdictTest, ...] = ()
    k_hat: float | None = None
    efficiency: float | None = None
    sampler: str | None = None
    answer: Mapping[str, Mapping[str, float | str]] = field(default_factory=dict)

    @property
    def may_be_read(self) -> bool:
        """Whether the posterior may be interpreted: neither contradicted nor outside the prior's support."""
        return self.status not in {Status.CONTRADICTED, Status.NOT_PRIOR_SUPPORTED}

    @property
    def acceptance(self) -> float:
        """Share of the candidates within the prior's bounds."""
        return self.in_prior_draws / self.candidate_draws

    def to_json(self) -> dict[str, Any]:
        """Return the content of ``verdict.json``; its last entries are of experiments on measured speeds."""
        plain = {
            "status": self.status,
            "sentence": self.sentence,
            "reasons": list(self.reasons),
            "max_abs_z": self.max_abs_z,
            "worst_component": self.worst_component,
            "in_prior_draws": self.in_prior_draws,
            "candidate_draws": self.candidate_draws,
            "acceptance": self.acceptance,
            "unfiltered_median": self.unfiltered_median,
        }
        if self.sampler is None:
            return plain
        return plain | {
            "k_hat": self.k_hat,
            "efficiency": self.efficiency,
            "sampler": self.sampler,
            "answer": {name: dict(said) for name, said in self.answer.items()},
            "tests": [asdict(test) for test in self.tests],
        }

    @classmethod
    def read(cls, path: Path) -> Verdict:
        """Read ``verdict.json`` of any experiment; what else is added to it is left alone."""
        try:
            plain = json.loads(path.read_text(encoding="utf-8"))
            required = {f.name for f in fields(cls) if f.default is f.default_factory is MISSING}
            named = {f.name: plain[f.name] for f in fields(cls) if f.name in {*required, *plain}}
            tests = tuple(VerdictTest(**test) for test in plain.get("tests", ()))
            said = {"status": Status(plain["status"]), "reasons": tuple(plain["reasons"]), "tests": tests}
            return cls(**{**named, **said})
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise ArtefactError(f"{path}: cannot be read as a verdict ({error}); delete it") from error

    def write(self, path: Path, made: Provenance) -> None:
        """Write ``verdict.json``, which has no room for what made it."""
        write_json(path, self.to_json())

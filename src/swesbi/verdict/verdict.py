"""What is said of one subject, and the file that keeps it: ``verdict.json``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts import ArtefactError

NOT_CONTRADICTED: Final = "not contradicted"
STRAINED: Final = "strained"
CONTRADICTED: Final = "contradicted"
UNINFORMATIVE: Final = "uninformative"
"""Of a recording that leaves every quantity as the prior has it, where nothing speaks against the model."""
STATUSES: Final = (NOT_CONTRADICTED, STRAINED, CONTRADICTED)
"""Of experiments on measured speeds, from good to bad."""
PRIOR_SUPPORTED: Final = "prior-supported"
NOT_PRIOR_SUPPORTED: Final = "not prior-supported"
PAPER_STATUSES: Final = (PRIOR_SUPPORTED, NOT_PRIOR_SUPPORTED)
"""Of experiments with noise on features, by the criterion of the paper."""


@dataclass(frozen=True)
class VerdictTest:
    """The outcome of one test of an experiment on measured speeds.

    Attributes:
        name: Name of the test.
        statistic: Its value.
        p_value: Under the model; None for a test without a null distribution.
        threshold: Of the p-value, at or below which the test is flagged; else of the statistic's size.
        flagged: The test contradicts the subject.
        detail: What it found, in words.
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
    empty; one on measured speeds judges by its misspecification tests and fills them.

    Attributes:
        max_abs_z: Largest |z_obs,j|.
        worst_component: Name of the component that attains it.
        in_prior_draws: Candidates within the prior's bounds.
        candidate_draws: Candidates drawn.
        unfiltered_median: Median of all candidates, by parameter.
        status: The outcome in one word: of an experiment on speeds "not contradicted", "strained",
            "contradicted" or "uninformative"; of one on features "prior-supported" or not.
        sentence: The outcome in a sentence.
        reasons: What contradicts the model, or why the prior does not support the subject; may be empty.
        tests: The misspecification tests.
        k_hat: Pareto shape of the importance weights.
        efficiency: Effective share of the weighted draws.
        sampler: What gave the exact draws, "importance" or "mcmc"; None of an experiment on features.
        answer: What the exact posterior says of each parameter, by name: median, limits of the credible
            interval, its mass and the unit.
    """

    max_abs_z: float
    worst_component: str
    in_prior_draws: int
    candidate_draws: int
    unfiltered_median: dict[str, float]
    status: str
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
        return self.status not in {CONTRADICTED, NOT_PRIOR_SUPPORTED}

    @property
    def acceptance(self) -> float:
        """Share of the candidates within the prior's bounds."""
        return self.in_prior_draws / self.candidate_draws

    def to_json(self) -> dict[str, Any]:
        """Return the content of ``verdict.json``."""
        return {
            "status": self.status,
            "sentence": self.sentence,
            "reasons": list(self.reasons),
            "max_abs_z": self.max_abs_z,
            "worst_component": self.worst_component,
            "in_prior_draws": self.in_prior_draws,
            "candidate_draws": self.candidate_draws,
            "acceptance": self.acceptance,
            "unfiltered_median": self.unfiltered_median,
            **self._graded(),
        }

    def _graded(self) -> dict[str, Any]:
        """Return what only an experiment on measured speeds has."""
        if self.sampler is None:
            return {}
        own = {name: getattr(self, name) for name in ("k_hat", "efficiency", "sampler")}
        own["answer"] = {name: dict(said) for name, said in self.answer.items()}
        return {**own, "tests": [asdict(test) for test in self.tests]}


def read_verdict(path: Path) -> Verdict:
    """Read ``verdict.json`` of any experiment; what else is added to it is left alone.

    Raises:
        ArtefactError: The file is missing or not such a file.
    """
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
        required = {f.name for f in fields(Verdict) if f.default is f.default_factory is MISSING}
        named = {f.name: plain[f.name] for f in fields(Verdict) if f.name in {*required, *plain}}
        tests = tuple(VerdictTest(**test) for test in plain.get("tests", ()))
        return Verdict(**{**named, "reasons": tuple(plain["reasons"]), "tests": tests})
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ArtefactError(f"{path}: cannot be read as a verdict ({error}); delete it") from error

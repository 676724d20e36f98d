"""Prior-support diagnostics: is a subject represented by the prior predictive at all? (paper, Sec. 2.5)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, Field, asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError
from swesbi.parameters import THETA_NAMES
from swesbi.prior import PriorSettings, bounds, in_bounds
from swesbi.verdict.settings import SupportSettings

FloatArray = NDArray[np.float64]
NAMED_COMPONENTS = 3


@dataclass(frozen=True)
class SupportTest:
    """The outcome of one test of an experiment on measured speeds.

    Attributes:
        name: Name of the test.
        statistic: Its value.
        p_value: Under the model; None for a test without a null distribution.
        threshold: Of the p-value, at or below which the test is flagged; else of the statistic's size.
        flagged: The test speaks against the subject.
        detail: What it found, in words.
    """

    name: str
    statistic: float
    p_value: float | None
    threshold: float
    flagged: bool
    detail: str


@dataclass(frozen=True)
class Support:
    """The verdict on one subject.

    An experiment with noise on features judges by both criteria of the paper and leaves the last fields
    empty; one on measured speeds judges by its misspecification tests and fills them.

    Attributes:
        max_abs_z: Largest |z_obs,j|.
        worst_component: Name of the component that attains it.
        in_prior_draws: Candidates within the prior's bounds.
        candidate_draws: Candidates drawn.
        unfiltered_median: Median of all candidates, by parameter.
        supported: Both criteria hold; of an experiment on speeds, that ``status`` is not "unsupported".
        verdict: The outcome in a sentence.
        reasons: Why the subject is not supported, or strained; empty if neither.
        status: "supported", "strained", "unsupported", "no verdict" or "uninformative"; None where there is
            no such grading.
        tests: The misspecification tests.
        k_hat: Pareto shape of the importance weights.
        efficiency: Effective share of the weighted draws.
        sampler: What gave the exact draws, "importance" or "mcmc".
        answer: What the exact posterior says of each parameter, by name: median, limits of the credible
            interval, its mass and the unit.
    """

    max_abs_z: float
    worst_component: str
    in_prior_draws: int
    candidate_draws: int
    unfiltered_median: dict[str, float]
    supported: bool
    verdict: str
    reasons: tuple[str, ...]
    status: str | None = None
    tests: tuple[SupportTest, ...] = ()
    k_hat: float | None = None
    efficiency: float | None = None
    sampler: str | None = None
    answer: Mapping[str, Mapping[str, float | str]] = field(default_factory=dict)

    @property
    def acceptance(self) -> float:
        """Share of the candidates within the prior's bounds."""
        return self.in_prior_draws / self.candidate_draws

    def to_json(self) -> dict[str, Any]:
        """Return the content of ``support.json``."""
        return {
            "max_abs_z": self.max_abs_z,
            "worst_component": self.worst_component,
            "in_prior_draws": self.in_prior_draws,
            "candidate_draws": self.candidate_draws,
            "acceptance": self.acceptance,
            "unfiltered_median": self.unfiltered_median,
            "supported": self.supported,
            "verdict": self.verdict,
            "reasons": list(self.reasons),
            **self._graded(),
        }

    def _graded(self) -> dict[str, Any]:
        """Return what only an experiment on measured speeds has."""
        if self.status is None:
            return {}
        own = {name: getattr(self, name) for name in ("k_hat", "efficiency", "sampler", "status")}
        own["answer"] = {name: dict(said) for name, said in self.answer.items()}
        return {**own, "tests": [asdict(test) for test in self.tests]}


def diagnose(
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    candidates: FloatArray,
    prior: PriorSettings,
    settings: SupportSettings,
) -> Support:
    """Apply both criteria: max |z_obs| <= max_abs_z, and enough candidates within the prior's bounds.

    Args:
        z_obs: (C,) observed conditioning vector, standardised with the pool's statistics.
        component_names: The names of its components.
        candidates: (n, 3) draws from the estimator given z_obs, unfiltered.
        prior: The prior whose bounds count.
        settings: The thresholds.
    """
    inside = int(in_bounds(candidates, prior).sum())
    median = np.nanmedian(np.where(np.isfinite(candidates), candidates, np.nan), axis=0)
    reasons = (
        *_far_components(z_obs, component_names, settings.max_abs_z),
        *_leakage(inside, len(candidates), median, prior, settings.min_in_prior_draws),
    )
    worst = int(np.argmax(np.abs(z_obs)))
    return Support(
        max_abs_z=float(np.abs(z_obs[worst])),
        worst_component=component_names[worst],
        in_prior_draws=inside,
        candidate_draws=len(candidates),
        unfiltered_median=dict(zip(THETA_NAMES, map(float, median), strict=True)),
        supported=not reasons,
        verdict=_verdict(reasons, float(np.abs(z_obs[worst])), inside, len(candidates)),
        reasons=reasons,
    )


def read_support(path: Path) -> Support:
    """Read ``support.json`` of any experiment; what else is added to it is left alone.

    Raises:
        ArtefactError: The file is missing or not such a file.
    """
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
        named = {f.name: plain[f.name] for f in fields(Support) if _is_required(f) or f.name in plain}
        tests = tuple(SupportTest(**test) for test in plain.get("tests", ()))
        return Support(**{**named, "reasons": tuple(plain["reasons"]), "tests": tests})
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ArtefactError(f"{path}: cannot be read as support diagnostics ({error}); delete it") from error


def _is_required(of: Field[Any]) -> bool:
    return of.default is MISSING and of.default_factory is MISSING


def _far_components(z_obs: FloatArray, names: tuple[str, ...], limit: float) -> list[str]:
    """Count the components beyond the limit and name the farthest."""
    order = np.argsort(-np.abs(z_obs))
    far = [f"{names[j]} (z = {z_obs[j]:.2f})" for j in order if not abs(z_obs[j]) <= limit]
    if not far:
        return []
    more = ", ..." if len(far) > NAMED_COMPONENTS else ""
    return [
        f"{len(far)} of {len(names)} components outside what the prior predicts, |z| <= {limit:g} required: "
        f"{', '.join(far[:NAMED_COMPONENTS])}{more}"
    ]


def _leakage(inside: int, drawn: int, median: FloatArray, prior: PriorSettings, required: int) -> list[str]:
    """Say that too few candidates lie within the bounds, and which medians lie beyond them."""
    if inside >= required:
        return []
    low, high = bounds(prior)
    beyond = [
        f"{name} {median[j]:.1f} outside [{low[j]:g}, {high[j]:g}]"
        for j, name in enumerate(THETA_NAMES)
        if not low[j] <= median[j] <= high[j]
    ]
    tail = f"; unfiltered median of {', '.join(beyond)}" if beyond else ""
    return [f"{inside} of {drawn} candidate draws lie within the prior's bounds, {required} required{tail}"]


def _verdict(reasons: tuple[str, ...], max_abs_z: float, inside: int, drawn: int) -> str:
    if reasons:
        return f"not supported by the prior: {'; '.join(reasons)}"
    return f"supported by the prior: max |z| = {max_abs_z:.2f}, {inside} of {drawn} candidate draws in bounds"


def support_numbers(support: Support) -> tuple[str, str]:
    """Return the two numbers that decide on prior support: draws within the bounds, largest |z|."""
    plural = "draw" if support.in_prior_draws == 1 else "draws"
    return f"{support.in_prior_draws:,} in-prior {plural}", f"max |z| = {support.max_abs_z:.2f}"

"""Prior-support diagnostics: is a subject represented by the prior predictive at all? (paper, Sec. 2.5)."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError
from swesbi.inference.settings import SupportSettings
from swesbi.simulations.prior import PriorSettings, bounds, in_bounds
from swesbi.theta import THETA_NAMES

FloatArray = NDArray[np.float64]
NAMED_COMPONENTS = 3


@dataclass(frozen=True)
class Support:
    """The outcome of both criteria for one subject.

    Attributes:
        max_abs_z: Largest |z_obs,j|.
        worst_component: Name of the component that attains it.
        in_prior_draws: Candidates within the prior's bounds.
        candidate_draws: Candidates drawn.
        unfiltered_median: Median of all candidates, by parameter.
        supported: Both criteria hold.
        verdict: The outcome in a sentence.
        reasons: Why the subject is not supported; empty if it is.
    """

    max_abs_z: float
    worst_component: str
    in_prior_draws: int
    candidate_draws: int
    unfiltered_median: dict[str, float]
    supported: bool
    verdict: str
    reasons: tuple[str, ...]

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
        }


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
    """Read ``support.json``; what an experiment adds to it is left alone.

    Raises:
        ArtefactError: The file is missing or not such a file.
    """
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
        named = {field.name: plain[field.name] for field in fields(Support)}
        return Support(**{**named, "reasons": tuple(plain["reasons"])})
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ArtefactError(f"{path}: cannot be read as support diagnostics ({error}); delete it") from error


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

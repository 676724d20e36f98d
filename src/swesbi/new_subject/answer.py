"""The answer for one subject as text."""

from __future__ import annotations

from collections.abc import Sequence

from swesbi.evaluation.exact_result import ExactResult
from swesbi.evaluation.verdict import sampler_in_words, weights_in_words
from swesbi.inference.support import Support
from swesbi.intervals import median_and_interval
from swesbi.parameters import PHI_NAMES
from swesbi.prior import ParameterPrior

WIDTH = 18


def answer_text(subject: str, result: ExactResult, support: Support, prior: Sequence[ParameterPrior]) -> str:
    """Return verdict, intervals and certificate in lines.

    Args:
        subject: Name.
        result: The exact posterior.
        support: The verdict.
        prior: Prior of each parameter of phi, whose bounds are printed beside the intervals.
    """
    doubt = "" if result.converged else "; NOT CONVERGED, do not use"
    mass = f"{100.0 * result.interval_mass:.0f} % interval"
    return "\n".join(
        [
            f"{subject}: {support.verdict}",
            *(f"  {reason}" for reason in support.reasons),
            f"{'':{WIDTH}}{'median':>8}  {mass:<18}  prior's bounds",
            *(_line(result, j, prior[j]) for j in range(len(PHI_NAMES))),
            f"certificate: draws by {sampler_in_words(support)}; weights: {weights_in_words(support)} "
            f"(k-hat at most {result.k_hat_limit:.2f}){doubt}",
        ]
    )


def _line(result: ExactResult, j: int, prior: ParameterPrior) -> str:
    low, median, high = median_and_interval(result.phi[:, j], result.interval_mass)
    interval = f"[{low:.4g}, {high:.4g}]"
    return f"{PHI_NAMES[j]:{WIDTH}}{median:8.4g}  {interval:<18}  {prior.low:g} to {prior.high:g}"

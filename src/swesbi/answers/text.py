"""An answer in lines, as the terminal shows it: verdict, intervals, certificate."""

from __future__ import annotations

from itertools import groupby
from typing import Final

from swesbi.answers.answer import Answer
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import ParameterPrior
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.verdict.answer_lines import ANSWER_LINES, IN_WORDS
from swesbi.verdict.summary import sampler_in_words, weights_in_words

WIDTH: Final = 24


def answer_text(answer: Answer) -> str:
    """Return verdict, intervals and certificate in lines, what can best be relied on first."""
    exact, verdict = answer.posterior, answer.verdict
    prior = answer.recording.model.settings.prior
    bounds = dict(zip(PHI_NAMES, prior.parameters, strict=False))
    lines = [f"{answer.recording.observation.subject}: {verdict.sentence}"]
    lines += [f"  {reason}" for reason in verdict.reasons]
    mass = f"{100.0 * exact.interval_mass:.0f} % interval"
    lines.append(f"{'':{WIDTH}}{'median':>8}  {mass:<18}  prior's bounds")
    for trust, group in groupby(ANSWER_LINES, lambda line: line.trust):
        where = " (each condition is in verdict.json)" if trust == "conditional" else ""
        lines.append(f"{IN_WORDS[trust]}{where}:")
        for line in group:
            name = line.parameter.name
            said, own = verdict.answer[name], bounds.get(name)
            lines.append(_line(name, float(said["median"]), float(said["low"]), float(said["high"]), own))
    if (both := answer.with_pressures) is not None:
        lines.append(_of_pressures(answer.recording.observation.clinical, both))
        ends = median_and_interval(both.phi, both.interval_mass)
        for name, low, median, high in zip(PHI_NAMES, *ends, strict=False):
            lines.append(_line(name, median, low, high, bounds.get(name)))
    lines.append(f"errors: {answer.recording.noise}")
    lines.append(
        f"certificate: draws by {sampler_in_words(verdict)}; weights: {weights_in_words(verdict)} "
        f"(k-hat at most {exact.k_hat_limit:.2f}){_doubt(exact)}"
    )
    return "\n".join(lines)


def _of_pressures(clinical: ClinicalMeasures, result: ExactPosterior) -> str:
    """Return what the answer with pressures is by, above its lines."""
    by = "MCMC" if result.by_mcmc else f"importance weights, efficiency {100.0 * result.efficiency:.0f} %"
    return (
        f"with cuff pressures {clinical.sbp_mmhg:g} / {clinical.dbp_mmhg:g} mmHg (by {by}{_doubt(result)}); "
        "the verdict is that of the speeds:"
    )


def _doubt(exact: ExactPosterior) -> str:
    return "" if exact.converged else "; NOT CONVERGED, do not use"


def _line(name: str, median: float, low: float, high: float, prior: ParameterPrior | None) -> str:
    interval = f"[{low:.4g}, {high:.4g}]"
    bounds = "" if prior is None else f"  {prior.low:g} to {prior.high:g}"
    return f"{name:{WIDTH}}{median:8.4g}  {interval:<18}{bounds}".rstrip()

"""The verdict on one subject, from tests with a null distribution, volumes, ejection, context and network.

The tests with a null distribution decide together, at an overall false-alarm rate. Predicted volumes can
make a subject doubtful, and contradict the model only where they lie extremely far; ejection time and
context can make it doubtful. How far model and echocardiography may differ in volumes and times the prior
does not say, so these have no null distribution, and their distance is given in units of a stated tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from pydantic import Field

from swesbi.artefacts import UnfitError
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER
from swesbi.base.settings import Settings
from swesbi.context import Context
from swesbi.draws import kernel_density, median_and_interval
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats
from swesbi.measurement.derived import reported
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, simulate_draws, speed_model
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Contexts, Observation
from swesbi.seeds import generator
from swesbi.verdict.answer_lines import ANSWER_LINES
from swesbi.verdict.beat import ejection_tests, volume_tests
from swesbi.verdict.context import context_tests
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.nulls import (
    BOUNDS,
    TESTS,
    WITH_STRIPS,
    Grade,
    Misfits,
    grade_of,
    misfits_of,
    nearest,
    overall_p,
    p_values,
    single_level,
)
from swesbi.verdict.settings import EjectionTimeSettings, RuleSettings
from swesbi.verdict.verdict import Verdict, VerdictTest

KNOWN_EFFICIENCY: Final = 0.3
"""Of a network that knows a recording; nothing depends on it."""
POINTS: Final = 200
TAILS: Final = 0.005  # left out on either side: single draws there are no modes
LEAST_MASS: Final = 0.1  # on either side of a valley
DEEPEST: Final = 0.7  # of the lower mode: a valley below it parts them; chance makes shallower ones
LEAST_DRAWS: Final = 50


def network_test(efficiency: Sequence[float]) -> VerdictTest:
    """Say how well the network knew the recording; the weights correct it, so it is never flagged.

    ``efficiency`` is of all draws after each round, of the network's own first.
    """
    rounds, last = len(efficiency) - 1, f"{efficiency[-1]:.0%} of all draws are"
    after = f"; after {rounds} rounds fitted to the recording, {last}" if rounds else ""
    return VerdictTest(
        name="network",
        statistic=efficiency[0],
        p_value=None,
        threshold=KNOWN_EFFICIENCY,
        flagged=False,
        detail=f"{efficiency[0]:.1%} of the network's own draws are effective{after}",
    )


class VerdictSettings(Settings):
    """What the verdict on a recording depends on."""

    model: SpeedModelSettings
    rule: RuleSettings
    ejection_time: EjectionTimeSettings
    lvet_sd_ms: float = Field(gt=0.0, description="standard deviation of a measured ejection time")


@dataclass(frozen=True)
class NullTests:
    """What the tests with a null distribution amount to, each and together.

    ``beyond`` tells that no null recording has as many speeds, or as few; empty where some have.
    """

    status: Grade
    overall_p: float
    tests: tuple[VerdictTest, ...]
    beyond: str = ""


def judge(
    exact: ExactPosterior,
    model: SpeedModel,
    beats: Beats,
    nulls: NullRecordings,
    others: Sequence[Context],
    settings: VerdictSettings,
    seed: int,
    clinical: ClinicalMeasures = NOT_MEASURED,
    further: Sequence[VerdictTest] = (),
) -> Verdict:
    """Judge a recording of any kind by its null tests, its volumes, its ejection, its context.

    The context is compared with those of ``others``; ``further`` tests can make the subject doubtful, as an
    ejection time can. The seed is of the factors of the errors, where these are not known.
    """
    context, rule = model.recording.context, settings.rule
    works = beats.status == Status.PERIODIC
    predicted = model.predict_from(exact.phi, beats).rows(np.flatnonzero(works))
    rng = generator(seed, "verdict", context.subject)
    misfits = misfits_of(model, exact.phi, works / works.sum(), predicted, rng)
    by_null = null_tests(nulls.gated if model.recording.cell is None else nulls.pushes, misfits, rule)
    volumes = volume_tests(model, exact.phi, beats, rule.volumes)
    ejection = ejection_tests(beats, context.period_s, clinical, settings.lvet_sd_ms, settings.ejection_time)
    contextual = (*ejection, *context_tests(context, others, nulls.contexts, rule.context_level), *further)
    status = grade(by_null.status, volumes, contextual, rule.volumes.contradicted_abs_z)
    tests = (*by_null.tests, *volumes, *contextual)
    z = np.abs(model.likeliest_residuals(predicted))
    where = f"speed at {model.recording.phase[int(np.argmax(z))]:.3f} of the cycle"
    answered = reported(model, exact.phi, beats)
    verdict = make_verdict(status, by_null.overall_p, tests, exact, (float(z.max()), where), answered)
    return replace(verdict, sentence=", ".join(filter(None, (verdict.sentence, by_null.beyond))))


def null_tests(null: Misfits, misfits: Misfits, rule: RuleSettings) -> NullTests:
    """Return what the tests of one recording (a row) amount to among null recordings.

    A test is flagged where its p-value alone brings the overall one to the level of "doubtful".
    """
    test_p, limit = p_values(null, misfits, rule), single_level(rule.doubtful_level)
    points = int(misfits.points[0])
    alike = nearest(null, points, bool(misfits.errors_log_sd[0] > 0.0)).points
    residuals = (
        f"posterior predictive p-value {misfits.residuals_p[0]:.2g} of {points} speeds, among null "
        f"recordings of {alike.min()} to {alike.max()}"
    )
    named = zip(TESTS, (residuals, boundary_detail(misfits.bound_ratio[0])), strict=True)
    tests = tuple(
        VerdictTest(name, float(value), float(p), limit, bool(p <= limit), detail)
        for (name, detail), value, p in zip(named, misfits.statistics()[0], test_p[0], strict=True)
    )
    overall = float(overall_p(test_p)[0])
    beyond = ""
    if not alike.min() <= points <= alike.max():
        beyond = f"among null recordings of {alike.min()} to {alike.max()} speeds, as none has its {points}"
    return NullTests(grade_of(overall, rule), overall, tests, beyond)


def grade(
    overall: Grade, volumes: Sequence[VerdictTest], contexts: Sequence[VerdictTest], extreme_abs_z: float
) -> Grade:
    """Return the worst of what the null tests, the volumes and the context amount to."""
    if any(abs(test.statistic) > extreme_abs_z for test in volumes):
        return Grade.CONTRADICTED
    if any(test.flagged for test in (*volumes, *contexts)):
        return max(overall, Grade.DOUBTFUL)
    return overall


def make_verdict(
    status: Grade,
    overall_p: float,
    tests: tuple[VerdictTest, ...],
    exact: ExactPosterior,
    farthest: tuple[float, str],
    answered: Mapping[str, FloatArray],
) -> Verdict:
    """Put the verdict together.

    No draw of the network can leave the prior's box, so all candidates are in-prior draws. ``farthest`` is in
    standard deviations, with its name; ``answered`` are draws (n,) of all that the answer reports, by name.
    """
    flagged = sorted((test for test in tests if test.flagged), key=_strength)
    median = np.median(exact.proposal_phi, axis=0)
    return Verdict(
        max_abs_z=farthest[0],
        worst_component=farthest[1],
        in_prior_draws=len(exact.proposal_phi),
        candidate_draws=len(exact.proposal_phi),
        unfiltered_median={name: float(median[j]) for j, name in enumerate(THETA_NAMES)},
        status=status.word,
        sentence=_sentence(status, overall_p, flagged),
        reasons=(*map(_reason, flagged), *exact.doubts, *modes_in_words(answered)),
        tests=tests,
        k_hat=exact.k_hat if np.isfinite(exact.k_hat) else None,
        efficiency=exact.efficiency,
        sampler=exact.sampler,
        answer=answer_of(answered, exact.interval_mass),
    )


def answer_of(reported: Mapping[str, FloatArray], mass: float) -> dict[str, dict[str, float | str]]:
    """Return what an answer reports, by name in the order of ``answer_lines.ANSWER_LINES``.

    Of draws (n,), NaN where a beat failed: median, limits of the credible interval, its mass, the unit, how
    far it can be relied on, and what it is conditional on.
    """
    answer: dict[str, dict[str, float | str]] = {}
    for line in ANSWER_LINES:
        name, draws = line.parameter.name, reported[line.parameter.name]
        low, median, high = median_and_interval(draws[np.isfinite(draws)], mass)
        answer[name] = {
            "median": float(median),
            "low": float(low),
            "high": float(high),
            "interval_mass": mass,
            "unit": line.parameter.unit,
            "trust": line.trust,
            "conditional_on": line.condition,
        }
    return answer


def boundary_detail(ratios: FloatArray) -> str:
    """Say at which face of the box the posterior has most over the prior, from ratios (m, 2)."""
    parameter, bound = np.unravel_index(int(np.nanargmax(ratios)), ratios.shape)
    return (
        f"the posterior has {ratios[parameter, bound]:.2g} times the prior's mass at the {BOUNDS[bound]} "
        f"bound of {WITH_STRIPS[parameter]}, and {np.nanmean(ratios):.2g} times over all bounds"
    )


def _reason(test: VerdictTest) -> str:
    name = _words(test)
    if test.p_value is None:
        return f"{name}: {test.detail}"
    return f"{name} (p = {test.p_value:.2g}, {test.threshold:.2g} allowed): {test.detail}"


def _sentence(status: Grade, overall_p: float, flagged: Sequence[VerdictTest]) -> str:
    """Say the verdict, the test that speaks loudest with what it found, and the names of the others."""
    together = f"overall p = {overall_p:.2g}"
    if not flagged:
        return f"{status.word}: no test contradicts the model, {together}"
    also = f"; also {', '.join(map(_words, flagged[1:]))}" if len(flagged) > 1 else ""
    return f"{status.word}: {_words(flagged[0])}: {flagged[0].detail}{also}; {together}"


def _strength(test: VerdictTest) -> float:
    """Order flagged tests: a p-value by how far it lies below its threshold, others by how far above."""
    if test.p_value is not None:
        return test.p_value / test.threshold
    return test.threshold / abs(test.statistic)


def _words(test: VerdictTest) -> str:
    return test.name.replace("_", " ")


def two_modes(values: FloatArray) -> tuple[float, float] | None:
    """Return the two modes of draws (n,), the lower value first; None where there is one.

    The density is a sum of normal kernels of Silverman's width (Density Estimation, 1986, Eq. 3.31).
    """
    known = values[np.isfinite(values)]
    low, high = np.quantile(known, [TAILS, 1.0 - TAILS]) if len(known) else (0.0, 0.0)
    if len(known) < LEAST_DRAWS or not low < high:
        return None
    quartiles = np.quantile(known, [0.25, 0.75])
    spread = min(known.std(), (quartiles[1] - quartiles[0]) / 1.34)
    if spread == 0.0:
        return None
    at = np.linspace(low, high, POINTS)
    density = kernel_density(known, at, 0.9 * spread * len(known) ** -0.2)
    before, after = np.maximum.accumulate(density), np.maximum.accumulate(density[::-1])[::-1]
    below = np.searchsorted(np.sort(known), at) / len(known)
    parted = (below >= LEAST_MASS) & (below <= 1.0 - LEAST_MASS)
    lower, depth = np.minimum(before, after), np.ones(POINTS)
    # of a few distinct draws the density may vanish on one side
    np.divide(density, lower, out=depth, where=parted & (lower > 0.0))
    valley = int(depth.argmin())
    if depth[valley] > DEEPEST:
        return None
    return float(at[density[:valley].argmax()]), float(at[valley + density[valley:].argmax()])


def modes_in_words(reported: Mapping[str, FloatArray]) -> tuple[str, ...]:
    """Return a sentence for each quantity of an answer, by name, whose draws (n,) have two modes.

    Its median may lie where hardly any draw is.
    """
    found = ((line.parameter, two_modes(reported[line.parameter.name])) for line in ANSWER_LINES)
    return tuple(
        f"{parameter.meaning} has two modes, about {modes[0]:.3g} and {modes[1]:.3g}"
        f"{'' if parameter.unit == '1' else f' {parameter.unit}'}"
        for parameter, modes in found
        if modes is not None
    )


def verdict_on_subject(
    posterior: ExactPosterior,
    null: NullRecordings,
    observation: Observation,
    contexts: Contexts,
    noise: CohortNoise,
    *,
    model: SpeedModelSettings,
    rule: RuleSettings,
    ejection_time: EjectionTimeSettings,
    lvet_sd_ms: float,
    seed: int,
) -> Verdict:
    """Judge a recording of a subject, whose context is compared with those of the rest of the cohort."""
    others, recorded = others_than(observation.subject, contexts), speed_model(observation, noise, model)
    settings = VerdictSettings(model=model, rule=rule, ejection_time=ejection_time, lvet_sd_ms=lvet_sd_ms)
    beats = simulate_draws(recorded, posterior.phi)
    verdict = judge(posterior, recorded, beats, null, others, settings, seed, observation.clinical)
    LOGGER.info("subject %s: %s", observation.subject, verdict.sentence)
    return verdict


def others_than(subject: str, contexts: Contexts) -> list[Context]:
    """Return the contexts of the other subjects; raise ArtefactError where the subject is not among them."""
    others = [context for context in contexts.of if context.subject != subject]
    if len(others) != len(contexts.of) - 1:
        names = ", ".join(context.subject for context in contexts.of)
        raise UnfitError("contexts", f"needs the context of subject {subject}; it holds those of {names}")
    return others

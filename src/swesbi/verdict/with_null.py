"""The verdict on one subject, from tests with a null distribution, volumes, ejection, context and network.

The tests with a null distribution decide together, at an overall false-alarm rate. Predicted volumes can
strain a subject, and contradict the model only where they lie extremely far; ejection time and context can
strain it. How far model and echocardiography may differ in volumes and times the prior does not say, so these
have no null distribution, and their distance is given in units of a stated tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from pydantic import Field

from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Settings
from swesbi.context import Context
from swesbi.draws import median_and_interval
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats
from swesbi.measurement.derived import told
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, log_likelihood, residuals
from swesbi.measurement.settings import SummarySettings
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.networks.flow.conditioning import ConditioningSettings, conditioning_of
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.seeds import generator
from swesbi.verdict.beat import ejection_tests, volume_tests
from swesbi.verdict.context import context_tests
from swesbi.verdict.nulls import Grade, Judgement, Reference
from swesbi.verdict.settings import EjectionTimeSettings, RuleSettings
from swesbi.verdict.statistics import (
    BOUNDS,
    FEATURE_TESTS,
    TESTS,
    WITH_STRIPS,
    Checks,
    PosteriorDraws,
    check_recording,
    strip_ratios,
)
from swesbi.verdict.trust import ANSWER
from swesbi.verdict.verdict import Verdict, VerdictTest

NAMED_FEATURES: Final = 3
KNOWN_EFFICIENCY: Final = 0.3
"""Of a network that knows a recording; nothing depends on it."""


def network_test(efficiency: Sequence[float]) -> VerdictTest:
    """Say how well the network knew the recording; the weights correct it, so it is never flagged.

    Args:
        efficiency: Of all draws after each round, of the network's own first.
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
    summary: SummarySettings
    strip_fraction: float
    rule: RuleSettings
    ejection_time: EjectionTimeSettings
    lvet_sd_ms: float = Field(gt=0.0, description="standard deviation of a measured ejection time")

    @property
    def conditioning(self) -> ConditioningSettings:
        """How measured speeds become features."""
        return conditioning_of(self.summary, self.model)


@dataclass(frozen=True)
class ByNull:
    """What the tests with a null distribution amount to.

    Attributes:
        status: Their verdict.
        overall_p: P-value of all together.
        tests: Each of them.
    """

    status: Grade
    overall_p: float
    tests: tuple[VerdictTest, ...]


Found = tuple[ByNull, tuple[float, str]]
"""What the null tests amount to, and what lies farthest out, in standard deviations, with its name."""


def against_reference(
    exact: ExactPosterior,
    model: SpeedModel,
    beats: Beats,
    reference: Reference,
    settings: VerdictSettings,
    seed: int,
) -> Found:
    """Judge the gated recording of ``model`` by the tests of ``reference``; the seed is of new recordings."""
    draws = _draws(model, exact, beats)
    rng = generator(seed, "verdict", model.recording.context.subject)
    checks = check_recording(model, draws, settings.conditioning, settings.strip_fraction, rng)
    judgement = reference.judge(checks)
    tests = null_tests(reference, checks, judgement)
    by_null = ByNull(Grade(judgement.status[0]), float(judgement.overall_p[0]), tests)
    return by_null, _farthest(exact, model, draws.predicted)


def judge(
    exact: ExactPosterior,
    model: SpeedModel,
    beats: Beats,
    found: Found,
    others: Sequence[Context],
    settings: VerdictSettings,
    clinical: ClinicalMeasures = NOT_MEASURED,
    further: Sequence[VerdictTest] = (),
) -> Verdict:
    """Judge a recording of any kind by what its null tests say, its volumes, its ejection, its context.

    Args:
        exact: The exact posterior of the recording.
        model: What simulates the subject.
        beats: Of the posterior's draws.
        found: Of :func:`against_reference`, or of ``pushes.against_pushes``.
        others: Contexts with which the subject's is compared.
        settings: Of the tests.
        clinical: What was measured of the subject; an ejection time can strain it.
        further: Other tests, which can strain the subject.
    """
    (by_null, farthest), context, rule = found, model.recording.context, settings.rule
    volumes = volume_tests(model, exact.phi, beats, rule.volumes)
    ejection = ejection_tests(beats, context.period_s, clinical, settings.lvet_sd_ms, settings.ejection_time)
    contextual = (*ejection, *context_tests(context, others, rule.context), *further)
    status = grade(by_null.status, volumes, contextual, rule.volumes.contradicted_abs_z)
    tests = (*by_null.tests, *volumes, *contextual)
    return make_verdict(status, by_null.overall_p, tests, exact, farthest, told(model, exact.phi, beats))


def _draws(model: SpeedModel, exact: ExactPosterior, beats: Beats) -> PosteriorDraws:
    """Return the equally weighted exact draws as the tests look at them."""
    works = beats.status == Status.PERIODIC
    return PosteriorDraws(
        phi=exact.phi,
        weight=works / works.sum(),
        predicted=model.predict_from(exact.phi, beats).rows(works),
        k_hat=exact.k_hat,
        efficiency=exact.efficiency,
    )


def _farthest(exact: ExactPosterior, model: SpeedModel, predicted: PredictedSpeeds) -> tuple[float, str]:
    """Return what lies farthest out, in standard deviations, and its name.

    Of what the network was shown, among what it was trained on; without a network, of the residuals at the
    likeliest draw.
    """
    if exact.components:
        worst = int(np.argmax(np.abs(exact.condition)))
        return float(np.abs(exact.condition[worst])), exact.components[worst]
    recording, discrepancy = model.recording, model.settings.discrepancy
    likeliest = int(np.argmax(log_likelihood(predicted, recording, discrepancy)))
    z = np.abs(residuals(predicted.rows(np.array([likeliest])), recording, discrepancy)[0])
    return float(z.max()), f"speed at {recording.phase[int(np.argmax(z))]:.3f} of the cycle"


def null_tests(reference: Reference, checks: Checks, judgement: Judgement) -> tuple[VerdictTest, ...]:
    """Return the outcome of every test with a null distribution on one recording.

    A test is flagged where its p-value alone brings the overall one to the level of "strained".
    """
    thresholds = reference.joint.thresholds(reference.strained_level)
    details = _details(reference, checks)
    return tuple(
        VerdictTest(
            name=test.name,
            statistic=float(judgement.statistics[0, index]),
            p_value=float(judgement.test_p[0, index]),
            threshold=float(thresholds[index]),
            flagged=bool(judgement.test_p[0, index] <= thresholds[index]),
            detail=details.get(test.name, test.meaning),
        )
        for index, test in enumerate(TESTS)
    )


def grade(
    overall: Grade, volumes: Sequence[VerdictTest], contexts: Sequence[VerdictTest], extreme_abs_z: float
) -> Grade:
    """Return the worst of what the null tests, the volumes and the context amount to."""
    if any(abs(test.statistic) > extreme_abs_z for test in volumes):
        return Grade.CONTRADICTED
    if any(test.flagged for test in (*volumes, *contexts)):
        return max(overall, Grade.STRAINED)
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

    No draw of the network can leave the prior's box, so all candidates are in-prior draws.

    Args:
        status: The verdict.
        overall_p: P-value of the tests with a null distribution, together.
        tests: All tests.
        exact: The exact posterior.
        farthest: What lies farthest out, in standard deviations, and its name.
        answered: Draws of all that the answer reports, by name; (n,) each.
    """
    flagged = sorted((test for test in tests if test.flagged), key=_strength)
    median = np.median(exact.npe_phi, axis=0)
    return Verdict(
        max_abs_z=farthest[0],
        worst_component=farthest[1],
        in_prior_draws=len(exact.npe_phi),
        candidate_draws=len(exact.npe_phi),
        unfiltered_median={name: float(median[j]) for j, name in enumerate(THETA_NAMES)},
        status=status.word,
        sentence=_sentence(status, overall_p, flagged),
        reasons=(*map(_reason, flagged), *exact.doubts),
        tests=tests,
        k_hat=exact.k_hat if np.isfinite(exact.k_hat) else None,
        efficiency=exact.efficiency,
        sampler=exact.sampler,
        answer=answer_of(answered, exact.interval_mass),
    )


def answer_of(told: Mapping[str, FloatArray], mass: float) -> dict[str, dict[str, float | str]]:
    """Return what an answer reports, by name in the order of ``trust.ANSWER``.

    Args:
        told: Draws of each quantity; (n,) each, NaN where a beat failed.
        mass: Mass of the credible intervals.

    Returns:
        Of each: median, limits of the credible interval, its mass, the unit, how far it can be relied on, and
        what it is conditional on.
    """
    answer: dict[str, dict[str, float | str]] = {}
    for line in ANSWER:
        name, draws = line.parameter.name, told[line.parameter.name]
        low, median, high = median_and_interval(draws[np.isfinite(draws)], mass)
        numbers = {"median": float(median), "low": float(low), "high": float(high), "interval_mass": mass}
        answer[name] = numbers | {
            "unit": line.parameter.unit, "trust": line.trust, "conditional_on": line.condition
        }  # fmt: skip
    return answer


def _details(reference: Reference, checks: Checks) -> Mapping[str, str]:
    """Say which features and which bound the tests found."""
    statistics = reference.statistics
    worst = statistics.worst_features(checks.tails[0])[:NAMED_FEATURES]
    features = ", ".join(f"{statistics.feature_names[j]} (P {checks.tails[0, j]:.3f})" for j in worst)
    return {
        "chi2": f"posterior predictive p-value of chi2 = {checks.chi2_p[0]:.3f}",
        "conditional_features": f"least likely given the recording: {features}",
        "boundary_mass": boundary_detail(checks.bound_mass[0], statistics.prior_mass, statistics.strip_level),
        **{
            name: f"{feature} is larger than in "
            f"{checks.tails[0, statistics.feature_names.index(feature)]:.1%} of replicated recordings"
            for name, feature in FEATURE_TESTS.items()
        },
    }


def boundary_detail(mass: FloatArray, prior_mass: FloatArray, level: float) -> str:
    """Say which strip contains the most, over what the prior has there."""
    ratio = np.where(prior_mass <= level, strip_ratios(mass, prior_mass), -np.inf)
    if not (mass[prior_mass <= level] > 0.0).any():
        return "no posterior mass at any bound where the prior has little"
    parameter, bound = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
    return (
        f"{mass[parameter, bound]:.1%} of the posterior in the strip at the {BOUNDS[bound]} bound of "
        f"{WITH_STRIPS[parameter]}, where the prior has {prior_mass[parameter, bound]:.2%}"
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

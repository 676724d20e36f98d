"""The verdict on one subject, from tests with a null distribution, volumes, ejection, context and network.

The tests with a null distribution decide together, at an overall false-alarm rate. Predicted volumes can
strain a subject, and contradict the model only where they lie extremely far; ejection time and context can
strain it. How far model and echocardiography may differ in volumes and times the prior does not say, so these
have no null distribution, and their distance is given in units of a stated tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from swesbi.draws import median_and_interval
from swesbi.parameters import THETA_NAMES
from swesbi.verdict.nulls import Grade, Judgement, Reference
from swesbi.verdict.statistics import BOUNDS, FEATURE_TESTS, TESTS, WITH_STRIPS, Checks, strip_ratios
from swesbi.verdict.trust import ANSWER
from swesbi.verdict.verdict import Verdict, VerdictTest

FloatArray = NDArray[np.float64]
NAMED_FEATURES: Final = 3
KNOWN_EFFICIENCY: Final = 0.3
"""Of a network that knows a recording; nothing depends on it."""


def network_test(efficiency: Sequence[float]) -> VerdictTest:
    """Say how well the network knew the recording; the weights make good for it, so it is never flagged.

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


class CertifiedPosterior(Protocol):
    """What the verdict says of the making of the posterior."""

    @property
    def phi(self) -> FloatArray:
        """Equally weighted exact draws, those that are reported first; shape (n, d)."""

    @property
    def interval_mass(self) -> float:
        """Mass of the credible intervals."""

    @property
    def npe_phi(self) -> FloatArray:
        """Draws of the network; shape (m, 4)."""

    @property
    def sampler(self) -> str:
        """What gave the exact draws: importance or mcmc."""

    @property
    def converged(self) -> bool:
        """Whether weights or sampler are reliable."""

    @property
    def reasons(self) -> str:
        """Why the weights were not used, and what the sampler missed; may be empty."""

    @property
    def k_hat(self) -> float:
        """Pareto shape of the weights."""

    @property
    def efficiency(self) -> float:
        """Effective share of the weighted draws."""


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
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    exact: CertifiedPosterior,
    told: Mapping[str, FloatArray],
) -> Verdict:
    """Put the verdict together.

    No draw of the network can leave the prior's box, so all candidates are in-prior draws.

    Args:
        status: The verdict.
        overall_p: P-value of the tests with a null distribution, together.
        tests: All tests.
        z_obs: Conditioning vector of the recording; shape (C,).
        component_names: Names of its components.
        exact: How the exact posterior was made.
        told: Draws of all that the answer tells, by name; (n,) each.
    """
    worst = int(np.argmax(np.abs(z_obs)))
    flagged = sorted((test for test in tests if test.flagged), key=_strength)
    reasons = tuple(map(_reason, flagged))
    unsure = () if exact.converged else (exact.reasons,)
    median = np.median(exact.npe_phi, axis=0)
    return Verdict(
        max_abs_z=float(np.abs(z_obs[worst])),
        worst_component=component_names[worst],
        in_prior_draws=len(exact.npe_phi),
        candidate_draws=len(exact.npe_phi),
        unfiltered_median={name: float(median[j]) for j, name in enumerate(THETA_NAMES)},
        status=status.word,
        sentence=_sentence(status, overall_p, flagged),
        reasons=(*reasons, *unsure),
        tests=tests,
        k_hat=exact.k_hat if np.isfinite(exact.k_hat) else None,
        efficiency=exact.efficiency,
        sampler=exact.sampler,
        answer=answer_of(told, exact.interval_mass),
    )


def answer_of(told: Mapping[str, FloatArray], mass: float) -> dict[str, dict[str, float | str]]:
    """Return what an answer tells, by name in the order of ``trust.ANSWER``.

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
        "boundary_mass": _boundary_detail(
            checks.bound_mass[0], statistics.prior_mass, statistics.strip_level
        ),
        **{
            name: f"{feature} is larger than in "
            f"{checks.tails[0, statistics.feature_names.index(feature)]:.1%} of replicated recordings"
            for name, feature in FEATURE_TESTS.items()
        },
    }


def _boundary_detail(mass: FloatArray, prior_mass: FloatArray, level: float) -> str:
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
        return f"{status.word}: no test speaks against the model, {together}"
    also = f"; also {', '.join(map(_words, flagged[1:]))}" if len(flagged) > 1 else ""
    return f"{status.word}: {_words(flagged[0])}: {flagged[0].detail}{also}; {together}"


def _strength(test: VerdictTest) -> float:
    """Order flagged tests: a p-value by how far it lies below its threshold, others by how far above."""
    if test.p_value is not None:
        return test.p_value / test.threshold
    return test.threshold / abs(test.statistic)


def _words(test: VerdictTest) -> str:
    return test.name.replace("_", " ")

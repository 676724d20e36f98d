"""What can be said for or against a recording that no null distributions are known of.

The tests of a gated recording look at features of a curve, and compare them with recordings of the same
phases. A free-running recording has neither. Two things need no nulls: the volumes and the ejection time that
the posterior predicts, whose tolerances are declared, and the posterior predictive p-value of the residuals.
That one is conservative: under the model, P(p <= a) <= 2 a (Meng 1994, Ann Stat 22:1142), so it is held
against half a level.
Where they do not speak against the model, there is no verdict: what they do not see, nobody has looked at.
A recording that leaves every quantity as the prior has it is called uninformative.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from scipy.special import chdtrc, logsumexp

from swesbi.base.arrays import FloatArray
from swesbi.measurement.instants import FreeModel
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.verdict.contraction import Contractions
from swesbi.verdict.nulls import Grade
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import NO_VERDICT, UNINFORMATIVE, Verdict, VerdictTest
from swesbi.verdict.with_null import answer_of, grade

WHY_NONE: Final = (
    "a free-running recording has no null distributions to be judged by, and neither residuals nor "
    "what else was measured speak against the model"
)
WHY_UNINFORMATIVE: Final = "the pushes leave every quantity as the prior has it"


def residual_test(
    model: FreeModel, predicted: PredictedSpeeds, rule: RuleSettings, rng: np.random.Generator
) -> VerdictTest:
    """Return the posterior predictive p-value of the squared residuals, over factors of the errors as well.

    Given phi and the factor, the standardised residuals of a new recording are independent normals, so that
    the p-value of each draw is that of chi-squared with as many degrees of freedom as there are pushes.

    Args:
        model: The recording and its model.
        predicted: Of n equally weighted posterior draws that can be simulated.
        rule: Levels of the verdict.
        rng: Draws the factor of each.
    """
    factor = model.draw_factor(predicted, rng)
    return tested_residuals(model.innovations(predicted, factor).chi_squared, len(model.cell), "pushes", rule)


def tested_residuals(chi_squared: FloatArray, count: int, of: str, rule: RuleSettings) -> VerdictTest:
    """Return the posterior predictive p-value of residuals that are independent normals at the true phi.

    Args:
        chi_squared: The sum of their squares at each of n equally weighted posterior draws; shape (n,).
        count: How many residuals there are.
        of: What they are of, in words.
        rule: Levels of the verdict.
    """
    p_value = float(np.mean(chdtrc(count, chi_squared)))
    level = 0.5 * rule.strained_level
    return VerdictTest(
        name="residuals",
        statistic=float(np.median(chi_squared)),
        p_value=p_value,
        threshold=level,
        flagged=p_value <= level,
        detail=f"squared residuals {np.median(chi_squared):.1f} of {count} {of} in the median, posterior "
        f"predictive p-value {p_value:.2g}",
    )


def verdict_without_null(
    model: FreeModel,
    exact: ExactPosterior,
    predicted: PredictedSpeeds,
    residuals: VerdictTest,
    volumes: Sequence[VerdictTest],
    ejection: Sequence[VerdictTest],
    contractions: Contractions,
    told: Mapping[str, FloatArray],
    rule: RuleSettings,
) -> Verdict:
    """Put together what is said of a recording that has no null distributions.

    Args:
        model: The recording and its model.
        exact: Its posterior.
        predicted: Of those of its draws that can be simulated.
        residuals: As of :func:`residual_test`.
        volumes: Predicted volumes beside the measured ones.
        ejection: The predicted ejection time likewise, where one was measured.
        contractions: The posterior of each quantity beside its prior.
        told: Draws of all that the answer tells, by name; (n,) each.
        rule: Levels and limits.
    """
    graded = grade(grade_of_residuals(residuals, rule), volumes, ejection, rule.volumes.contradicted_abs_z)
    flagged = [test for test in (residuals, *volumes, *ejection) if test.flagged]
    unspoken = (UNINFORMATIVE, WHY_UNINFORMATIVE) if contractions.uninformative else (NO_VERDICT, WHY_NONE)
    word = graded.word if graded else unspoken[0]
    found = "; ".join(f"{test.name.replace('_', ' ')}: {test.detail}" for test in flagged) or unspoken[1]
    z = np.abs(_residuals_at_best(model, predicted))
    median = np.median(exact.npe_phi, axis=0)
    return Verdict(
        max_abs_z=float(z.max()),
        worst_component=f"push at {model.model.recording.phase[int(np.argmax(z))]:.3f} of its beat",
        in_prior_draws=len(exact.npe_phi),
        candidate_draws=len(exact.npe_phi),
        unfiltered_median={name: float(median[j]) for j, name in enumerate(THETA_NAMES)},
        status=word,
        sentence=f"{word}: {found}",
        reasons=(*(f"{test.name}: {test.detail}" for test in flagged), *exact.doubts, contractions.in_words),
        tests=(residuals, *volumes, *ejection, *contractions.tests),
        k_hat=exact.k_hat if np.isfinite(exact.k_hat) else None,
        efficiency=exact.efficiency,
        sampler=exact.sampler,
        answer=answer_of(told, exact.interval_mass),
    )


def grade_of_residuals(test: VerdictTest, rule: RuleSettings) -> Grade:
    """Return what the residuals amount to; their p-value is held against half a level."""
    p_value = 1.0 if test.p_value is None else test.p_value
    if p_value <= 0.5 * rule.contradicted_level:
        return Grade.CONTRADICTED
    return Grade.STRAINED if test.flagged else Grade.NOT_CONTRADICTED


def _residuals_at_best(model: FreeModel, predicted: PredictedSpeeds) -> FloatArray:
    """Return the standardised residuals at the likeliest of n simulations; shape (p,)."""
    best = np.array([int(np.argmax(logsumexp(model.log_joint(predicted), axis=0)))])
    return np.asarray(model.innovations(predicted.rows(best)).z[0])

"""What the page can say for or against a recording without null distributions: its residuals, its volumes."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.special import chdtrc

from swesbi.base.arrays import FloatArray
from swesbi.heart.periodic import Status
from swesbi.measurement.likelihood import SpeedModel, standardise
from swesbi.verdict.beat import volume_tests
from swesbi.verdict.nulls import Grade
from swesbi.verdict.recording import grade
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import GRADES, VerdictTest

NO_VERDICT: Final = "no verdict"
"""Of a recording that nothing here speaks against: the page has no null distributions."""


def judged_without_nulls(
    model: SpeedModel, phi: FloatArray, rule: RuleSettings
) -> tuple[str, tuple[VerdictTest, ...]]:
    """Return a verdict in a word, and the tests that it rests on, by equally weighted posterior draws (n, d).

    It is "no verdict" where neither residuals nor volumes speak against it; an LVESV that is NaN is left out.
    """
    beats = model.simulate(phi)
    predicted = model.predict_from(phi, beats).rows(np.flatnonzero(beats.status == Status.PERIODIC))
    found = standardise(predicted, model.recording, model.settings.discrepancy).chi_squared
    residuals = tested_residuals(found, len(model.recording.phase), rule)
    volumes = volume_tests(model, phi, beats, rule.volumes)
    measured = tuple(test for test in volumes if np.isfinite(test.statistic))
    status = grade(grade_of_residuals(residuals, rule), measured, (), rule.volumes.contradicted_abs_z)
    word = NO_VERDICT if status == Grade.NOT_CONTRADICTED else GRADES[status]
    return word, (residuals, *measured)


def tested_residuals(chi_squared: FloatArray, count: int, rule: RuleSettings) -> VerdictTest:
    """Return the posterior predictive p-value of residuals that are independent normals at the true phi.

    It is conservative: under the model, P(p <= a) <= 2 a (Meng 1994, Ann Stat 22:1142), so it is held against
    half a level. ``chi_squared`` sums the ``count`` squares at each of n equally weighted draws.
    """
    p_value = float(np.mean(chdtrc(count, chi_squared)))
    level = 0.5 * rule.doubtful_level
    return VerdictTest(
        name="residuals",
        statistic=float(np.median(chi_squared)),
        p_value=p_value,
        threshold=level,
        flagged=p_value <= level,
        detail=f"squared residuals {np.median(chi_squared):.1f} of {count} phases in the median, posterior "
        f"predictive p-value {p_value:.2g}",
    )


def grade_of_residuals(test: VerdictTest, rule: RuleSettings) -> Grade:
    """Return what the residuals amount to; their p-value is held against half a level."""
    p_value = 1.0 if test.p_value is None else test.p_value
    if p_value <= 0.5 * rule.contradicted_level:
        return Grade.CONTRADICTED
    return Grade.DOUBTFUL if test.flagged else Grade.NOT_CONTRADICTED

"""What the page can say for or against a recording without null distributions: its residuals, its volumes."""

from __future__ import annotations

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.periodic import Status
from swesbi.measurement.likelihood import SpeedModel, standardise
from swesbi.verdict.nulls import Grade
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import NO_VERDICT, STATUSES, VerdictTest
from swesbi.verdict.volumes import volume_tests
from swesbi.verdict.with_null import grade
from swesbi.verdict.without_null import grade_of_residuals, tested_residuals


def judged_without_nulls(
    model: SpeedModel, phi: FloatArray, rule: RuleSettings
) -> tuple[str, tuple[VerdictTest, ...]]:
    """Return a verdict in a word, and the tests that it rests on.

    Args:
        model: A gated recording and its model; an LVESV that is NaN is not looked at.
        phi: Equally weighted posterior draws (n, d).
        rule: Levels and tolerances of the study.

    Returns:
        "strained", "contradicted", or "no verdict" where neither residuals nor volumes speak against it.

    Raises:
        ValueError: No beat becomes periodic with a wall of another thickness.
    """
    beats = model.simulate(phi)
    predicted = model.predict_from(phi, beats).rows(np.flatnonzero(beats.status == Status.PERIODIC))
    found = standardise(predicted, model.recording, model.settings.discrepancy).chi_squared
    residuals = tested_residuals(found, len(model.recording.phase), "phases", rule)
    volumes = volume_tests(model, phi, beats, rule.volumes)
    measured = tuple(test for test in volumes if np.isfinite(test.statistic))
    status = grade(grade_of_residuals(residuals, rule), measured, (), rule.volumes.contradicted_abs_z)
    word = NO_VERDICT if status == Grade.NOT_CONTRADICTED else STATUSES[status]
    return word, (residuals, *measured)

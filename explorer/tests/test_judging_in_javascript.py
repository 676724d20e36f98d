"""The page judges as the study does, as far as no null distributions are needed."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Final

import numpy as np
import pytest
import speed_case
from javascript import evaluate, find_node

from explorer.judged import judged_without_nulls
from explorer.physics import physics
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording
from swesbi.verdict.beat import WALL_DRAWS

JUDGE: Final = """
const a = (list) => np.array(list), parts = given.recording.map(a), { context } = given;
const heart = call(physics.Context, [], { ...context, lvesv_ml: context.lvesv_ml ?? NaN });
const recording = new physics.SpeedRecording(heart, ...parts, np.empty([parts[0].length, 0]));
const model = new physics.SpeedModel(recording, physics.settings);
const [word, tests] = physics.judged_without_nulls(model, a(given.phi), physics.rule);
return { word, tests: tests.map((one) => [one.name, one.statistic, one.p_value, one.flagged, one.detail]) };
"""


def near_the_centre(draws: int = 40) -> np.ndarray:
    """Return phi within some percent of the prior's centre."""
    prior = speed_case.settings("calibrated").prior
    centre = np.array([parameter.centre for parameter in prior.parameters])
    return np.asarray(centre * np.exp(0.03 * np.random.default_rng(5).standard_normal((draws, len(centre)))))


def recorded(off: float = 0.0, lvesv_ml: float | None = None) -> SpeedModel:
    """Return a recording of the prior's centre, every second speed off by so much, and its model."""
    settings, phi = speed_case.settings("calibrated"), near_the_centre()
    blank = speed_case.model(prior="calibrated").recording
    speed = SpeedModel(blank, settings).predict(phi[:1]).speed_m_s[0]
    context = blank.context if lvesv_ml is None else replace(blank.context, lvesv_ml=lvesv_ml)
    signs = np.where(np.arange(len(speed)) % 2, 1.0, -1.0)
    errors = np.full(len(speed), 0.03)
    return SpeedModel(
        SpeedRecording(context, blank.phase, speed * np.exp(off * signs), errors, blank.shared), settings
    )


def own_volume_ml() -> float:
    """Return the end-systolic volume of the centre, which no volume test can hold against it."""
    return float(np.median(recorded().simulate(near_the_centre()).end_systolic_volume_ml))


def test_what_fits_has_no_verdict_and_what_does_not_is_contradicted() -> None:
    rule, phi, volume = speed_case.rule(), near_the_centre(), own_volume_ml()
    word, tests = judged_without_nulls(recorded(lvesv_ml=volume), phi, rule)
    assert word == "no verdict" and not any(test.flagged for test in tests)
    assert [test.name for test in tests] == ["residuals", "end_diastolic_volume", "end_systolic_volume"]
    word, (residuals, *_) = judged_without_nulls(recorded(0.15, volume), phi, rule)
    assert word == "contradicted" and residuals.flagged and residuals.p_value == pytest.approx(0.0, abs=1e-6)
    word, tests = judged_without_nulls(recorded(lvesv_ml=3.0 * volume), phi, rule)
    assert word in {"doubtful", "contradicted"} and [test.flagged for test in tests] == [False, False, True]
    _, tests = judged_without_nulls(recorded(lvesv_ml=float("nan")), phi, rule)
    assert [test.name for test in tests] == ["residuals", "end_diastolic_volume"], "nobody measured the other"


@pytest.mark.parametrize("off", [0.0, 0.15])
@pytest.mark.parametrize("measured", [True, False])
def test_the_page_says_the_same(tmp_path: Path, off: float, measured: bool) -> None:
    find_node()
    program = physics(speed_case.settings("calibrated"), speed_case.exact(), speed_case.rule())
    model, phi = (
        recorded(off, own_volume_ml() if measured else float("nan")),
        near_the_centre(WALL_DRAWS + 20),
    )
    own = model.recording
    given = {
        "context": asdict(own.context) | ({} if measured else {"lvesv_ml": None}),
        "recording": [part.tolist() for part in (own.phase, own.speed_m_s, own.relative_se)],
        "phi": phi.tolist(),
    }
    word, tests = judged_without_nulls(model, phi, speed_case.rule())
    found = evaluate(tmp_path, program, JUDGE, given)
    assert found["word"] == word and len(found["tests"]) == len(tests) == 2 + measured
    for (name, statistic, p_value, flagged, detail), test in zip(found["tests"], tests, strict=True):
        assert (name, flagged, detail) == (test.name, test.flagged, test.detail)
        assert statistic == pytest.approx(test.statistic, rel=1e-6)
        assert p_value == (None if test.p_value is None else pytest.approx(test.p_value, rel=1e-6, abs=1e-12))

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from calibration_case import JUDGEMENT
from evaluation_cases import INTERVAL, PRIOR, TITLE, check, posterior_theta, verdict
from figure_text import assert_text_apart, text_boxes
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.artefacts.typed import Place
from swesbi.checks.calibration.table import ALARM_COLUMNS, ALARMS
from swesbi.checks.identifiability import QUANTITY_NAMES
from swesbi.report.figures.calibration import misspecification_figure
from swesbi.report.figures.identifiability import draw_identifiability
from swesbi.report.figures.workflow import SHOWN_CURVES, shown_subject, workflow_figure
from swesbi.verdict.nulls import TESTS
from swesbi.verdict.verdict import STATUSES, Verdict, VerdictTest

RNG = np.random.default_rng(1)
Z = RNG.standard_normal((60, 53))
OBSERVED = RNG.standard_normal(53)
EPOCHS = np.arange(1, 102)
LOSS = 8.0 * np.exp(-EPOCHS / 20.0) - 5.0
HISTORY = pd.DataFrame({"epoch": EPOCHS, "training_loss": LOSS, "validation_loss": LOSS + 0.1})


def workflow(subject: str, *, supported: bool, history: pd.DataFrame = HISTORY) -> Figure:
    place = Place("paper", subject)
    pool: Any = SimpleNamespace(
        z=Z,
        subjects=[subject, "other"],
        subject_index=np.repeat([0, 1], 30),
        draw_index=np.tile(np.repeat(np.arange(3), 10), 2),
        observed_z=lambda name: OBSERVED,
    )
    draws = posterior_theta(subject, 500)
    posterior: Any = SimpleNamespace(theta=draws, unfiltered=draws, interval_mass=INTERVAL)
    judged = ({place: check(subject, supported)}, {place: posterior}, {place: verdict(subject, supported)})
    return workflow_figure(pool, history, *judged, cohort_title=TITLE, prior=PRIOR)


@pytest.mark.parametrize(
    ("subject", "supported", "history"),
    [("A", True, HISTORY), ("F", False, HISTORY), ("B", True, HISTORY.iloc[:1])],
)
def test_the_workflow_names_who_is_shown(subject: str, supported: bool, history: pd.DataFrame) -> None:
    figure = workflow(subject, supported=supported, history=history)
    assert_text_apart(figure)
    assert any(TITLE in text for text, _ in text_boxes(figure))
    assert ("here F, who is excluded" in figure.get_suptitle()) != supported


def test_the_workflow_shows_what_it_is_given() -> None:
    _, curves, features, training, _, recording = workflow("A", supported=True).axes
    shown = check("A", True)
    assert len(curves.lines) == SHOWN_CURVES
    np.testing.assert_array_equal(curves.lines[4].get_ydata(), shown.prior.draws.curve_kpa[4])
    np.testing.assert_array_equal(features.lines[2].get_ydata(), Z[2])
    np.testing.assert_array_equal(features.lines[10].get_ydata(), OBSERVED)
    np.testing.assert_array_equal(training.lines[1].get_ydata(), HISTORY["validation_loss"])
    assert any(np.array_equal(line.get_ydata(), shown.target.curve_kpa) for line in recording.lines)


@pytest.mark.parametrize(("supported", "shown"), [("AB", "A"), ("BC", "C"), ("", "C")])
def test_the_first_supported_subject_is_shown(supported: str, shown: str) -> None:
    verdicts = {Place("paper", name): verdict(name, name in supported) for name in "CAB"}
    assert shown_subject(verdicts).subject == shown


def misspecification(subjects: str) -> Figure:
    """Subject i has the i-th status and p-values of 10^-i."""
    kinds = ("model_noise", "sample_by_sample")
    rates = [(kind, alarm, 0.05, 0.03, 0.08, 600) for kind in kinds for alarm in ALARMS]
    volume = VerdictTest("end_diastolic_volume", -12.4, None, 3.0, True, "")
    context = VerdictTest("context_leave_one_out", 1.0, 0.9, 0.01, False, "")
    verdicts = {}
    for i, name in enumerate(subjects):
        tests = [VerdictTest(test, 2.0, 10.0**-i, 0.01, i >= 2, "") for test in TESTS]
        status = STATUSES[i % len(STATUSES)]
        verdicts[name] = Verdict(1.0, "maximum_kpa", 10, 10, {}, status, "", (), (*tests, volume, context))
    table = pd.DataFrame(rates, columns=list(ALARM_COLUMNS))
    return misspecification_figure(
        table, verdicts, cohort_title=TITLE, doubtful_level=0.05, judgement=JUDGEMENT
    )


@pytest.mark.parametrize("subjects", ["A", "ABCDEF"])
def test_every_verdict_is_named(subjects: str) -> None:
    figure = misspecification(subjects)
    assert_text_apart(figure)
    texts = [text for text, _ in text_boxes(figure)]
    assert {f"{name}: {STATUSES[i % len(STATUSES)]}" for i, name in enumerate(subjects)} <= set(texts)


def test_flagged_p_values_are_filled_none_is_off_the_axis_and_rates_have_their_intervals() -> None:
    axes, rates = misspecification("ABCDEF").axes[:2]
    marks = [line for line in axes.get_lines() if line.get_marker() == "o" and len(line.get_xdata())]
    filled = [line for line in marks if line.get_markerfacecolor() != "white"]
    assert sum(len(line.get_xdata()) for line in filled) == 4 * len(TESTS)  # of C to F
    assert sum(len(line.get_xdata()) for line in marks) == 6 * (len(TESTS) + 1)
    shown = np.concatenate([line.get_xdata() for line in marks])
    assert shown.min() == pytest.approx(1e-4) and axes.get_xlim()[0] < 1e-4
    lines = np.array([line[:, 0] for part in rates.collections for line in part.get_segments()])
    np.testing.assert_allclose(lines, [[0.03, 0.08]] * (2 * len(ALARMS)))


SUBJECTS = ("A", "B", "$C")
DURATION_S, ISOMETRIC_KPA = 0.3, 50.0
SENSITIVITY = {"sensitivity_prior": 0.02, "sensitivity_nuisances": 0.04, "sensitivity_likelihood": 0.3}
PHASES = (np.arange(20) + 0.5) / 20.0


def draws(subject: str) -> np.ndarray:
    rng = np.random.default_rng(len(subject))
    scores = rng.multivariate_normal(np.zeros(2), [[1.0, -0.8], [-0.8, 1.0]], 400)
    return np.asarray(np.array([60.0, 6.0]) * np.exp(0.2 * scores))


@pytest.fixture(scope="module")
def identifiability() -> Figure:
    posteriors: Any = {name: SimpleNamespace(phi=draws(name)) for name in SUBJECTS}
    pairs = [(subject, row, name) for subject in SUBJECTS for row, name in enumerate(QUANTITY_NAMES)]
    summary = pd.DataFrame(
        [
            {"subject": subject, "quantity": name, "contraction_log": 0.5 + 0.1 * row}
            for subject, row, name in pairs
        ]
    ).assign(median=ISOMETRIC_KPA, activation_duration_s=DURATION_S, **SENSITIVITY)
    lost = [
        {"subject": subject, "quantity": name, "phase": phase, "expected_sd_increase": 0.1 * phase}
        for subject, _, name in pairs
        for phase in PHASES[: 20 if subject == "A" else 15]
    ]
    drawn = draw_identifiability(posteriors, summary, pd.DataFrame(lost), cohort_title="test")
    drawn.draw_without_rendering()
    return drawn


def ticks(axes: Axes, axis: str) -> int:
    low, high = sorted(getattr(axes, f"get_{axis}lim")())
    return sum(low <= tick <= high for tick in getattr(axes, f"get_{axis}ticks")())


def test_every_quantity_has_its_row_and_every_part_its_colour(identifiability: Figure) -> None:
    contraction, sensitivity = identifiability.axes[:2]
    x, y = contraction.lines[0].get_data()
    np.testing.assert_allclose(x, 0.5 + 0.1 * np.asarray(y))
    whole = len(SUBJECTS) * len(QUANTITY_NAMES)
    parts = [line for line in sensitivity.lines if len(line.get_xdata()) == whole]
    assert [line.get_xdata()[0] for line in parts] == [*SENSITIVITY.values()]
    assert len({line.get_color() for line in parts}) == 3
    assert [str(line.get_label()) for line in sensitivity.lines][-1] == "0.05: sensitive"


def test_draws_stand_beside_the_line_of_their_isometric_stiffness(identifiability: Figure) -> None:
    for axes, subject in zip(identifiability.axes[2:5], SUBJECTS, strict=True):
        points, line = axes.lines
        assert set(points.get_xdata()) <= set(draws(subject)[:, 1])
        k_atp, k_0 = map(np.asarray, line.get_data())
        np.testing.assert_allclose(k_0 * -np.expm1(-k_atp * DURATION_S), ISOMETRIC_KPA)
        r = np.corrcoef(np.log(draws(subject)).T)[0, 1]
        assert axes.get_title(loc="left").endswith(f"= −{-r:.2f}")
        assert "s$^{-1}$" in axes.get_xlabel() and axes.get_xscale() == axes.get_yscale() == "log"
    assert "kPa" in identifiability.axes[2].get_ylabel()


def test_the_loss_without_a_phase_is_in_percent_by_subject(identifiability: Figure) -> None:
    panels = identifiability.axes[5:]
    assert len(panels) == len(QUANTITY_NAMES) and "%" in panels[0].get_ylabel()
    for axes in panels:
        assert [len(line.get_xdata()) for line in axes.lines] == [20, 15, 15]
        np.testing.assert_allclose(axes.lines[0].get_ydata(), 10.0 * PHASES)
    assert all(ticks(axes, axis) >= 3 for axes in identifiability.axes for axis in "xy")

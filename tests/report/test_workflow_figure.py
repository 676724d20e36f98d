"""Figure 1: readable, and of real values of the first subject whose posterior may be read."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from evaluation_cases import INTERVAL, PRIOR, TITLE, check, posterior_theta, verdict
from figure_text import assert_text_apart, text_boxes
from matplotlib.figure import Figure

from swesbi.artefacts.typed import Place
from swesbi.report.figures.workflow import SHOWN_CURVES, shown_subject, workflow_figure

RNG = np.random.default_rng(1)
Z = RNG.standard_normal((60, 53))
OBSERVED = RNG.standard_normal(53)
EPOCHS = np.arange(1, 102)
LOSS = 8.0 * np.exp(-EPOCHS / 20.0) - 5.0
HISTORY = pd.DataFrame({"epoch": EPOCHS, "training_loss": LOSS, "validation_loss": LOSS + 0.1})


def drawn(subject: str, *, supported: bool, history: pd.DataFrame = HISTORY) -> Figure:
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
    judged: Any = (
        {place: check(subject, supported)},
        {place: posterior},
        {place: verdict(subject, supported)},
    )
    return workflow_figure(pool, history, *judged, cohort_title=TITLE, prior=PRIOR)


@pytest.mark.parametrize(
    ("subject", "supported", "history"),
    [("A", True, HISTORY), ("F", False, HISTORY), ("B", True, HISTORY.iloc[:1])],
)
def test_no_text_lies_on_text(subject: str, supported: bool, history: pd.DataFrame) -> None:
    figure = drawn(subject, supported=supported, history=history)
    assert_text_apart(figure)
    assert any(TITLE in text for text, _ in text_boxes(figure))
    assert ("here F, who is excluded" in figure.get_suptitle()) != supported


def test_it_shows_what_it_is_given() -> None:
    _, curves, features, training, _, recording = drawn("A", supported=True).axes
    shown = check("A", True)
    assert len(curves.lines) == SHOWN_CURVES
    np.testing.assert_array_equal(curves.lines[4].get_ydata(), shown.prior.draws.curve_kpa[4])
    np.testing.assert_array_equal(features.lines[2].get_ydata(), Z[2])
    np.testing.assert_array_equal(features.lines[10].get_ydata(), OBSERVED)
    np.testing.assert_array_equal(training.lines[1].get_ydata(), HISTORY["validation_loss"])
    assert any(np.array_equal(line.get_ydata(), shown.target.curve_kpa) for line in recording.lines)


def test_the_first_supported_subject_is_shown() -> None:
    def verdicts(*supported: bool) -> dict[Place, Any]:
        return {
            Place("paper", name): verdict(name, told) for name, told in zip("CAB", supported, strict=True)
        }

    assert shown_subject(verdicts(False, True, True)).subject == "A"
    assert shown_subject(verdicts(True, False, True)).subject == "C"
    assert shown_subject(verdicts(False, False, False)).subject == "C"
    with pytest.raises(ValueError, match="cohort is empty"):
        shown_subject({})

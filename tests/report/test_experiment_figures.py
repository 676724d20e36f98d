"""Figure 1 and the experiments beside each other: readable, from real values, for any study."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from comparison_case import context
from evaluation_cases import PRIOR, TITLE, check, posterior_theta, verdict
from figure_text import assert_text_apart, text_boxes

from swesbi.artefacts.typed import Place
from swesbi.context import CONTEXT_NAMES
from swesbi.measurement.settings import SCALAR_NAMES, SUMMARY_NAMES
from swesbi.parameters import THETA_NAMES
from swesbi.report.figures.workflow import draw_workflow, shown_subject
from swesbi.report.figures.workflow_panels import WorkflowPicture, groups

K_ATP = THETA_NAMES.index("k_atp_per_s")


def picture(
    subject: str = "A", supported: bool = True, features: tuple[str, ...] = SUMMARY_NAMES
) -> WorkflowPicture:
    components = features + CONTEXT_NAMES
    rng = np.random.default_rng(1)
    epochs = np.arange(1, 102)
    loss = 8.0 * np.exp(-epochs / 20.0) - 5.0
    return WorkflowPicture(
        subject=subject,
        context=context(subject),
        prior=PRIOR,
        check=check(subject, supported),
        components=components,
        pool_z=rng.standard_normal((500, len(components))),
        sample_z=rng.standard_normal((20, len(components))),
        z_obs=rng.standard_normal(len(components)),
        theta=posterior_theta(subject, 500),
        verdict=verdict(subject, supported),
        history=pd.DataFrame({"epoch": epochs, "training_loss": loss, "validation_loss": loss + 0.1}),
        estimator="MAF",
        subjects=6,
        rows=120_000,
    )


PICTURES = {
    "supported": picture(),
    "excluded": picture("F", supported=False),
    "scalars alone": picture(features=SCALAR_NAMES),
    "long name": picture("a-subject-with-a-name-of-more-than-forty-letters", supported=False),
    "training of one epoch": replace(picture(), history=picture().history.iloc[:1]),
    "one copy, far away": replace(picture(), sample_z=9.0 + np.zeros((1, 53)), z_obs=np.full(53, -7.0)),
}


@pytest.mark.parametrize("name", PICTURES)
def test_workflow_has_no_text_on_text(name: str) -> None:
    figure = draw_workflow(PICTURES[name], TITLE)
    assert_text_apart(figure)
    assert any(TITLE in text for text, _ in text_boxes(figure))


def test_workflow_shows_what_it_is_given() -> None:
    shown = picture()
    curves, features, training, recording, observed = draw_workflow(shown, TITLE).axes[3:8]
    np.testing.assert_array_equal(curves.lines[4].get_ydata(), shown.check.prior.draws.curve_kpa[4])
    np.testing.assert_array_equal(features.lines[2].get_ydata(), shown.sample_z[2])
    np.testing.assert_array_equal(training.lines[1].get_ydata(), shown.history["validation_loss"])
    np.testing.assert_array_equal(recording.lines[0].get_ydata(), shown.check.target.curve_kpa)
    np.testing.assert_array_equal(observed.lines[0].get_ydata(), shown.z_obs)
    texts = [text for text, _ in text_boxes(draw_workflow(shown, TITLE))]
    assert {"16\nscalars", "30\ntrajectory", "7\ncont.", "120,000 rows"} <= set(texts)


def test_groups_of_components() -> None:
    assert list(groups(SUMMARY_NAMES + CONTEXT_NAMES)) == [
        ("scalars", 0, 15),
        ("trajectory", 16, 45),
        ("context", 46, 52),
    ]
    assert list(groups(SCALAR_NAMES + CONTEXT_NAMES)) == [("scalars", 0, 15), ("context", 16, 22)]


def test_the_first_supported_subject_is_shown() -> None:
    def verdicts(*supported: bool) -> dict[Place, object]:
        return {
            Place("paper", name): verdict(name, told) for name, told in zip("CAB", supported, strict=True)
        }

    assert shown_subject(verdicts(False, True, True)).subject == "A"
    assert shown_subject(verdicts(True, False, True)).subject == "C"
    assert shown_subject(verdicts(False, False, False)).subject == "C"
    with pytest.raises(ValueError, match="cohort is empty"):
        shown_subject({})

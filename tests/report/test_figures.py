"""Figures: no text on text, embedded fonts, same bytes twice, any number of subjects, the excluded marked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from evaluation_cases import INTERVAL, PRIOR, TITLE, posterior_panels, predictive_panels
from figure_text import assert_text_apart, text_boxes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox
from PIL import Image

from swesbi.artefacts import ArtefactError
from swesbi.networks.training_tables import TRAINING
from swesbi.report.figures.density import log_density_of_draws, log_density_of_prior
from swesbi.report.figures.posterior import draw_cohort_posteriors
from swesbi.report.figures.posterior_subject import draw_subject_posterior
from swesbi.report.figures.predictive import draw_cohort_checks, draw_subject_check
from swesbi.report.figures.style import EXCLUDED_BACKGROUND, save_figure
from swesbi.report.figures.training import draw_training

MANY = [f"patient-{number:03d}" for number in range(14)]


def history(epochs: int = 30) -> pd.DataFrame:
    epoch = np.arange(1, epochs + 1)
    loss = 3.0 * np.exp(-epoch / 8.0)
    return pd.DataFrame({"epoch": epoch, "training_loss": loss, "validation_loss": loss + 0.002 * epoch})


def figures() -> dict[str, Figure]:
    checks, marginals = predictive_panels(), posterior_panels()
    return {
        "ppc": draw_cohort_checks(checks, TITLE),
        "posterior": draw_cohort_posteriors(marginals, PRIOR, INTERVAL, TITLE),
        "ppc-A": draw_subject_check(checks[0], TITLE),
        "ppc-F": draw_subject_check(checks[5], TITLE),
        "posterior-A": draw_subject_posterior(marginals[0], PRIOR, INTERVAL, TITLE),
        "posterior-F": draw_subject_posterior(marginals[5], PRIOR, INTERVAL, TITLE),
        "training": draw_training(history(), trained_on=TITLE),
        "ppc-many": draw_cohort_checks(predictive_panels(MANY, MANY[3:5]), TITLE),
        "posterior-many": draw_cohort_posteriors(posterior_panels(MANY, MANY[3:5]), PRIOR, INTERVAL, TITLE),
        "ppc-one": draw_cohort_checks(predictive_panels("E", "E"), TITLE),
        "posterior-one": draw_cohort_posteriors(posterior_panels("A", ""), PRIOR, INTERVAL, TITLE),
    }


@pytest.fixture(scope="module")
def drawn() -> dict[str, Figure]:
    return figures()


NAMES = ["ppc", "posterior", "ppc-A", "ppc-F", "posterior-A", "posterior-F", "training"]
NAMES += ["ppc-many", "posterior-many", "ppc-one", "posterior-one"]


@pytest.mark.parametrize("name", NAMES)
def test_no_text_overlaps_another_or_leaves_the_figure(drawn: dict[str, Figure], name: str) -> None:
    assert_text_apart(drawn[name])


def test_the_overlap_test_can_fail() -> None:
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.subplots()
    axes.text(0.5, 0.5, "one text")
    axes.text(0.52, 0.5, "another")
    boxes = [box for text, box in text_boxes(figure) if text in ("one text", "another")]
    assert Bbox.intersection(*boxes) is not None


def test_excluded_subjects_are_greyed_and_say_why(drawn: dict[str, Figure]) -> None:
    panels = drawn["ppc"].axes
    grey = tuple(int(EXCLUDED_BACKGROUND[i : i + 2], 16) / 255 for i in (1, 3, 5))
    greyed = [axes.get_facecolor()[:3] == pytest.approx(grey) for axes in panels]
    assert greyed == [False] * 4 + [True] * 2
    assert "0 in-prior draws" in panels[5].texts[0].get_text()
    assert not any(line.get_label() == "posterior median" for line in panels[5].lines)
    assert any(line.get_label() == "posterior median" for line in panels[0].lines)


def test_files_are_the_same_twice_and_hold_no_time(tmp_path: Path) -> None:
    for part in ("one", "other"):
        save_figure(
            draw_cohort_checks(predictive_panels("AE", "E"), TITLE),
            tmp_path / f"{part}.png",
            tmp_path / f"{part}.pdf",
        )
    for name in ("{}.png", "{}.pdf"):
        one, other = ((tmp_path / name.format(part)).read_bytes() for part in ("one", "other"))
        assert one == other
        assert b"CreationDate" not in one and b"tIME" not in one


def test_pdf_embeds_truetype_fonts(drawn: dict[str, Figure], tmp_path: Path) -> None:
    save_figure(drawn["ppc"], tmp_path / "ppc.pdf")
    content = (tmp_path / "ppc.pdf").read_bytes()
    assert b"/FontFile2" in content and b"/Type3" not in content


def test_figures_of_huge_cohorts_stay_within_what_libraries_open(tmp_path: Path) -> None:
    save_figure(Figure(figsize=(400.0, 1.0)), tmp_path / "wide.png")
    with Image.open(tmp_path / "wide.png") as image:
        assert image.width == 30_000


def test_figures_do_not_depend_on_the_users_style(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib as mpl

    save_figure(draw_training(history(), trained_on=TITLE), tmp_path / "plain.png")
    with mpl.rc_context({"font.size": 20.0, "axes.facecolor": "pink", "savefig.bbox": "tight"}):
        save_figure(draw_training(history(), trained_on=TITLE), tmp_path / "styled.png")
    assert (tmp_path / "plain.png").read_bytes() == (tmp_path / "styled.png").read_bytes()


def test_other_formats_and_empty_cohorts_are_refused(drawn: dict[str, Figure], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"\.pdf or \.png"):
        save_figure(drawn["ppc"], tmp_path / "ppc.svg")
    with pytest.raises(ValueError, match="cohort is empty"):
        draw_cohort_checks([], TITLE)
    with pytest.raises(ValueError, match="cohort is empty"):
        draw_cohort_posteriors([], PRIOR, INTERVAL, TITLE)


def test_training_history_is_checked(tmp_path: Path) -> None:
    path = tmp_path / "training.csv"
    history().drop(columns="validation_loss").to_csv(path, index=False)
    with pytest.raises(ArtefactError, match="validation_loss"):
        TRAINING.read(path)
    history().iloc[:0].to_csv(path, index=False)
    with pytest.raises(ArtefactError, match="holds no epoch"):
        TRAINING.read(path)


def test_densities_integrate_to_one_over_log_theta() -> None:
    for prior in PRIOR.parameters:
        theta, density = log_density_of_prior(prior)
        assert np.trapezoid(density, np.log(theta)) == pytest.approx(1.0, abs=1e-3)
    draws = np.exp(np.random.default_rng(0).normal(1.0, 0.3, 5000))
    theta, density = log_density_of_draws(draws)
    assert np.trapezoid(density, np.log(theta)) == pytest.approx(1.0, abs=0.01)

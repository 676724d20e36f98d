from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from figure_text import assert_text_apart
from posterior_case import exact_of

from swesbi.checks.information import MoreRepeats
from swesbi.checks.scores import Band
from swesbi.context import Context
from swesbi.parameters import PHI_NAMES, REPORTED_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.samples import REASONS
from swesbi.report.figures.sheet import draw_sheet
from swesbi.report.figures.style import drawing, save_figure
from swesbi.report.sheet import (
    Population,
    PressuresPosterior,
    RecordingSummary,
    Sheet,
    ShownCurve,
    header,
    notes,
    rows,
    verdict_text,
)
from swesbi.verdict.answer_lines import ANSWER_LINES
from swesbi.verdict.verdict import Verdict

CONTEXT = Context("S-1", "F", 31.0, 1.7, 66.0, 95.0, 36.0, 0.82)
OF_NAME = {"k0_kpa": 60.0, "k_atp_per_s": 5.0, "k_sr_per_s": 40.0, "passive_stiffness_kpa": 2.0}
MEDIANS = np.array([OF_NAME.get(name, 50.0) for name in REPORTED_NAMES])
Q = len(REPORTED_NAMES)
VERDICT = Verdict(
    1.0, "", 10, 10, {}, "not contradicted", "not contradicted: no test contradicts the model", (),
    k_hat=0.3, efficiency=0.4, sampler="importance",
)  # fmt: skip


def _spread(log_sd: float, seed: int) -> np.ndarray:
    return np.asarray(MEDIANS * np.exp(log_sd * np.random.default_rng(seed).standard_normal((4000, Q))))


def _result(*reasons: str) -> ExactPosterior:
    draws = _spread(0.1, 1)[:, [REPORTED_NAMES.index(name) for name in PHI_NAMES]]
    return exact_of(draws, efficiency=0.4, converged=not reasons, reasons=reasons)


def _curve() -> ShownCurve:
    grid = np.linspace(0.0, 1.0, 50)
    middle = 5.0 + 30.0 * np.exp(-0.5 * ((grid - 0.3) / 0.1) ** 2)
    band = Band(middle, 0.9 * middle, 1.1 * middle)
    at = slice(2, 50, 5)
    new = Band(middle[at], 0.9 * middle[at], 1.1 * middle[at])
    measured = middle[at] * np.array([1.0, 1.05, 0.95, 1.0, 1.3, 1.0, 1.0, 1.0, 1.0, 0.8])
    return ShownCurve(grid, band, band, grid[at], measured, 0.05 * measured, new, 0.9, noisy=True)


@pytest.fixture
def sheet() -> Sheet:
    """A subject not contradicted, recorded with some rejections."""
    return Sheet(
        context=CONTEXT,
        verdict=VERDICT,
        result=_result(),
        values=_spread(0.1, 1),
        recorded=RecordingSummary(
            "10 of 10 gated phases measured", "samples", "repeats", 90, {"low_r2": 7, "outlier": 3}
        ),
        curve=_curve(),
        population=Population("of the prior of the study", _spread(0.5, 2), [CONTEXT]),
        more=MoreRepeats((2.0, 4.0, 8.0), np.full((3, Q), 0.9)),
        informed=(),
        cohort_title=r"virtual volunteers of $\nothing$",  # no mathematics
    )


def test_the_best_known_stand_first_and_what_pressures_tell_beside_them(sheet: Sheet) -> None:
    """Duration and peak hold whatever the structure; the rest is valid under conditions."""
    labels = [row[0] for row in rows(sheet)]
    assert labels[0].startswith("duration") and labels[1].startswith("peak stiffness")
    valid_if = next(note for note in notes(sheet) if note.startswith("Valid only if"))
    conditional = [line.short for line in ANSWER_LINES if line.trust == "conditional"]
    assert [line.short for line in ANSWER_LINES if f"{line.short} (" in valid_if] == conditional
    informed = [PressuresPosterior(ClinicalMeasures(120.0, 80.0), _result())]
    assert "120 / 80 mmHg as well: k_0 " in "".join(notes(replace(sheet, informed=informed)))


def test_rates_stand_in_time_as_well(sheet: Sheet) -> None:
    shown = rows(sheet)
    low, median, high = sheet.limits
    rates = {"decay_rate_per_s", "k_sr_per_s", "k_atp_per_s"}
    assert {name for name, row in zip(REPORTED_NAMES, shown, strict=True) if row[3]} == rates
    j = REPORTED_NAMES.index("k_atp_per_s")
    assert shown[j][3] == f"{1e3 / median[j]:.0f} ({1e3 / high[j]:.0f} to {1e3 / low[j]:.0f})"


def test_percentiles_are_those_of_the_population_and_the_check_counts_what_lies_inside(sheet: Sheet) -> None:
    below = replace(sheet, values=sheet.values * 0.01)
    assert [row[4] for row in rows(below)] == ["0 (0 to 0)"] * Q
    middle, low, high = rows(sheet)[0][4].replace("(", "").replace(")", "").replace(" to", "").split()
    assert abs(int(middle) - 50) <= 3
    assert int(low) < 42 < 58 < int(high)
    assert sheet.curve.inside == 8
    for words in ("Of 1 hearts for comparison", "8 of 10 measured phases lie in the 90 % interval"):
        assert any(words in note for note in notes(sheet))


def test_more_repeats_stand_in_columns_or_nowhere(sheet: Sheet) -> None:
    assert header(sheet)[5:] == ("2-fold", "4-fold", "8-fold")
    assert rows(sheet)[0][5:] == ("90 %", "90 %", "90 %")
    untold = replace(sheet, more=None, result=_result("R-hat 1.30"))
    assert len(header(untold)) == len(rows(untold)[0]) == 5
    assert not any("more would buy" in note for note in notes(untold))
    assert notes(untold)[0] == "NOT CONVERGED, do not use: R-hat 1.30"
    draw_sheet(untold)


def test_a_contradicted_subject_is_no_measurement(sheet: Sheet) -> None:
    reasons = ("boundary mass: 22 % of the posterior at a bound", "other: too far")
    sentence = f"contradicted: {reasons[0]}"
    verdict = replace(VERDICT, status="contradicted", sentence=sentence, reasons=reasons)
    assert verdict_text(verdict) == ("contradicted", (f"B{reasons[0][1:]}", reasons[1]))
    assert notes(replace(sheet, verdict=verdict))[0].startswith("CONTRADICTED")


def test_the_page_is_one_on_which_no_text_lies_on_another(sheet: Sheet, tmp_path: Path) -> None:
    """Its parts stand at fixed places: with every reason for which samples are rejected, too."""
    figure = draw_sheet(
        replace(sheet, recorded=replace(sheet.recorded, rejected=dict.fromkeys(REASONS, 111)))
    )
    assert_text_apart(figure)
    save_figure(figure, tmp_path / "sheet.pdf")
    assert len(re.findall(rb"/Type /Page\s", (tmp_path / "sheet.pdf").read_bytes())) == 1


def test_a_layout_is_one_and_the_same_wherever_it_lies_in_memory(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    found, held = set(), []
    for _ in range(3):
        blocks = [bytearray(size) for size in rng.integers(1, 400, 30_000)]
        held.append([blocks[i] for i in rng.permutation(len(blocks))[:5_000]])  # what stays leaves gaps
        del blocks
        with drawing(8.27, 11.69) as figure:
            page = figure.add_gridspec(
                3, 3, width_ratios=(0.55, 7.17, 0.55), height_ratios=(0.55, 10.6, 0.55)
            )
            inner = figure.add_subfigure(page[1, 1])
            for number, part in enumerate(inner.subfigures(5, 1, height_ratios=(1.3, 2.4, 1.3, 2.7, 2.8))):
                for panel in part.subplots(1, 6, width_ratios=(3.0, 1.0, 1.0, 2.0, 1.0, 1.0)):
                    panel.plot([0.0, 1.0 / 3.0**number], [0.1, 7.0], label="a line")
                    panel.set(title=f"{number / 7.0:.3g}", ylabel="y")
                part.legend(loc="outside lower center", ncols=6)
        save_figure(figure, tmp_path / "parts.pdf")
        places = tuple(tuple(axes.get_position().extents) for axes in figure.axes)
        found.add((places, (tmp_path / "parts.pdf").read_bytes()))
    assert len(found) == 1

"""A recording dropped on the explorer: read, checked and inferred there, in the words of the study."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import explorer_case
import numpy as np
import pytest
import speed_case
from browser import Browser, until

from explorer.dropped import dropped_recording
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.problems import RecordingError

RECORDING: Final = explorer_case.COHORT / "swe" / "C.csv"
TABLE: Final = explorer_case.COHORT / "subjects.csv"
WORDS: Final = "document.getElementById('own-words').textContent"
DROP: Final = """(() => {
  const given = new DataTransfer();
  for (const [name, content] of FILES) given.items.add(new File([content], name));
  document.dispatchEvent(new DragEvent("drop", { dataTransfer: given, cancelable: true, bubbles: true }));
})()"""


def dropped(page: Browser, **contents: str) -> None:
    """Drop files, by their names without the ending."""
    files = [[f"{name}.csv", content] for name, content in contents.items()]
    page.evaluate(DROP.replace("FILES", json.dumps(files)))


@pytest.mark.exhaustive(minutes=0.3)
def test_a_dropped_recording_is_the_studys_own(page: Browser) -> None:
    dropped(page, C=RECORDING.read_text(), subjects=TABLE.read_text())
    until(page, "document.body.dataset.own")
    words = page.evaluate(WORDS)
    observed = explorer_case.observation("C")
    assert words.startswith(
        f"C: {observed.measured.sum()} of 20 phases, {observed.samples_accepted.sum()} samples"
    )
    assert "The heart is that of its row of the table." in words
    assert page.evaluate("document.getElementById('hr_bpm-value').value") == f"{observed.context.hr_bpm:g}"
    speeds = measured_speeds(observed, explorer_case.NOISE)
    for name in ("phase", "speed_m_s", "relative_se", "shared"):
        found = np.array(page.evaluate(f"state.subject.recording.{name}"))
        np.testing.assert_allclose(found, getattr(speeds, name), rtol=1e-9)
    page.evaluate("document.getElementById('errors').value = 'own'")
    page.evaluate("document.getElementById('errors').dispatchEvent(new Event('change'))")
    own = measured_speeds(observed).relative_se.tolist()
    until(page, f"Math.abs(state.subject.recording.relative_se[0] / {own[0]!r} - 1) < 1e-9")
    assert page.evaluate("state.subject.recording.shared[0].length") == 0


@pytest.mark.exhaustive(minutes=1)
def test_it_is_inferred_and_moved(page: Browser) -> None:
    dropped(page, C=RECORDING.read_text(), subjects=TABLE.read_text())
    until(page, "document.body.dataset.own")
    assert page.evaluate("document.getElementById('median').disabled")
    page.evaluate("document.getElementById('infer').click()")
    until(page, "document.body.dataset.inferred === 'C'")
    assert page.evaluate("document.getElementById('sampling').textContent").startswith("Reliable: Pareto")
    assert page.evaluate("state.subject.draws.length") == page.evaluate("study.prior_draws.length")
    assert page.evaluate("document.getElementById('download').download") == "posterior-C.csv"
    judged = page.evaluate("document.getElementById('judged').textContent")
    assert judged and page.evaluate("document.getElementById('verdict').textContent") == judged
    page.evaluate("document.getElementById('median').click()")
    assert page.evaluate("state.phi") == page.evaluate("state.inferred.quantiles[1]")


@pytest.mark.exhaustive(minutes=0.3)
def test_several_recordings_are_subjects_side_by_side(page: Browser) -> None:
    other = explorer_case.COHORT / "swe" / "D.csv"
    dropped(page, C=RECORDING.read_text(), D=other.read_text(), subjects=TABLE.read_text())
    until(page, "document.body.dataset.own === 'D'")
    options = page.evaluate("[...document.getElementById('subject').options].map(one => one.textContent)")
    assert options[-2:] == ["C (your file)", "D (your file)"]
    page.evaluate("document.getElementById('subject').selectedIndex -= 1")
    page.evaluate("document.getElementById('subject').dispatchEvent(new Event('change'))")
    until(page, "document.body.dataset.own === 'C'")
    observed = explorer_case.observation("C")
    assert page.evaluate("state.subject.recording.speed_m_s.length") == observed.measured.sum()
    assert page.evaluate("document.getElementById('hr_bpm-value').value") == f"{observed.context.hr_bpm:g}"
    assert "The heart is that of its row of the table." in page.evaluate(WORDS)
    dropped(page, C=RECORDING.read_text())
    until(page, f"{WORDS}.startsWith('C: ')")
    assert page.evaluate("document.getElementById('subject').options.length") == len(options)


@pytest.mark.exhaustive(minutes=0.3)
def test_what_is_wrong_is_said_in_the_words_of_the_command_line(page: Browser, tmp_path: Path) -> None:
    broken = tmp_path / "C.csv"
    broken.write_text(RECORDING.read_text().replace(",ok", ",OK", 2))
    settings, context = speed_case.shipped().recording, explorer_case.observation("C").context
    with pytest.raises(RecordingError) as refused:
        dropped_recording(broken, context, settings)
    dropped(page, C=broken.read_text(), subjects=TABLE.read_text())
    until(page, f"{WORDS}.includes('is none of')")
    assert page.evaluate(WORDS) == str(refused.value).replace(str(broken), "C.csv")
    assert page.evaluate("document.getElementById('infer').disabled")
    assert page.evaluate("state.subject.recording") is None


@pytest.mark.exhaustive(minutes=0.3)
def test_without_a_row_the_heart_is_that_of_the_sliders(page: Browser) -> None:
    """Subject A's heart rate is another: the recording is refused, until the slider says its own."""
    observed = explorer_case.observation("C")
    page.evaluate("state.context.hr_bpm = 180; moved()")
    dropped(page, C=RECORDING.read_text())
    until(page, f"{WORDS}.includes('the median RR interval is')")
    assert "The heart is that of the sliders: move them" in page.evaluate(WORDS)
    box = "document.getElementById('hr_bpm-value')"
    page.evaluate(f"{box}.value = '{observed.context.hr_bpm:g}'; {box}.dispatchEvent(new Event('change'))")
    until(page, "document.body.dataset.own === 'C'")
    assert "The heart is that of the sliders." in page.evaluate(WORDS)
    dropped(page, subjects=TABLE.read_text())
    until(page, f"{WORDS}.includes('its row of the table')")

"""The page reads recordings as the study does: the same numbers of good ones, the same words of bad ones."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
import speed_case
from cohorts import recording, write_cohort
from javascript import evaluate, find_node
from kinds import GATED_TABLE, SUBJECT_TABLE
from recordings import RECORDING

from explorer.dropped import dropped_hearts, dropped_recording
from explorer.physics import physics
from swesbi.context import Context
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.problems import RecordingError
from swesbi.recording.speed import NoiseComponents

HEART: Final = Context("S-1", "F", 25, 1.7, 60, 90, 34, 0.8)
NOISE: Final = NoiseComponents(0.04, 0.08, 0.02)
READ: Final = """
const heart = call(physics.Context, [], given.heart), settings = given.settings;
return given.files.map(([path, content]) => {
  files.contents.set(path, Uint8Array.from(atob(content), (sign) => sign.charCodeAt(0)));
  try {
    return { read: READER };
  } catch (error) {
    if (!(error instanceof RecordingError)) throw error;
    return { refused: error.message };
  }
});
"""
RECORDINGS: Final = """(() => {
  const observed = physics.dropped_recording(path, heart, settings), found = [observed];
  const noise = call(NoiseComponents, [], given.noise);
  const speeds = [physics.measured_speeds(observed, noise), physics.measured_speeds(observed)];
  return { measured: observed.measured.tolist(), index: observed.phase_index.tolist(),
    curve: observed.curve_kpa.tolist(), noise: Object.values(observed.noise),
    speeds: speeds.map((one) => [...one].slice(1, 5).map((part) => part.tolist())) };
})()"""
HEARTS: Final = "[...physics.dropped_hearts(path)].map(([name, heart]) => [name, Object.fromEntries(heart)])"


@pytest.fixture(scope="module")
def program() -> str:
    find_node()
    return physics(speed_case.settings("calibrated"), speed_case.exact(), speed_case.rule())


def in_javascript(folder: Path, program: str, reader: str, paths: list[Path]) -> list[dict[str, Any]]:
    """Return what the page makes of each file: what is read, or the words of the refusal."""
    given = {
        "heart": vars(HEART),
        "noise": vars(NOISE),
        "settings": json.loads(RECORDING.model_dump_json()),
        "files": [[str(path), base64.b64encode(path.read_bytes()).decode()] for path in paths],
    }
    return list(evaluate(folder, program, READ.replace("READER", reader), given))


def refusal(read: Callable[[], object]) -> str | None:
    """Return the words with which Python refuses; None where it does not."""
    try:
        read()
    except RecordingError as error:
        return str(error)
    return None


def written(folder: Path, name: str, content: str) -> Path:
    path = folder / name
    path.write_text(content)
    return path


def test_good_recordings_give_the_same_numbers(tmp_path: Path, program: str) -> None:
    semicolons = recording(seed=3).to_csv(index=False, sep=";", decimal=",")
    modulus = recording(seed=4).assign(
        youngs_modulus_kpa=lambda made: 3.0 * made.pop("shear_wave_speed_m_s") ** 2
    )
    commented = "# made by hand\r\n" + recording(seed=5).to_csv(index=False, lineterminator="\r\n")
    fewer = recording(seed=6).query("phase_index not in [4, 11] or repeat == 0")
    made = {
        "plain.csv": recording().to_csv(index=False),
        "semicolons.csv": semicolons,
        "modulus.csv": modulus.to_csv(index=False),
        "commented.csv": "\ufeff" + commented,
        "fewer.csv": fewer.to_csv(index=False),
    }
    paths = [written(tmp_path, name, content) for name, content in made.items()]
    for path, found in zip(paths, in_javascript(tmp_path, program, RECORDINGS, paths), strict=True):
        own = dropped_recording(path, HEART, RECORDING)
        assert "read" in found, found
        its = found["read"]
        assert its["index"] == own.phase_index.tolist() and its["measured"] == own.measured.tolist()
        np.testing.assert_allclose(its["curve"], own.curve_kpa, rtol=1e-11)
        np.testing.assert_allclose(
            its["noise"][:2], [own.noise.repeat_fraction, own.noise.sample_fraction], rtol=1e-9
        )
        for parts, noise in zip(its["speeds"], (NOISE, None), strict=True):
            speeds = measured_speeds(own, noise)
            mine = (speeds.phase, speeds.speed_m_s, speeds.relative_se, speeds.shared)
            for one, other in zip(parts, mine, strict=True):
                np.testing.assert_allclose(np.reshape(one, other.shape), other, rtol=1e-9)


def test_bad_recordings_are_refused_in_the_same_words(tmp_path: Path, program: str) -> None:
    paths = []
    for number, (change, _) in enumerate(GATED_TABLE):
        cohort = write_cohort(tmp_path / str(number) / "cohort")
        change(cohort)
        paths.append(cohort / "swe" / "S-1.csv")
    words = [refusal(lambda path=path: dropped_recording(path, HEART, RECORDING)) for path in paths]
    found = in_javascript(tmp_path, program, RECORDINGS, paths)
    assert [part.get("refused") for part in found] == words
    assert sum(word is None for word in words) <= 3, "a fault of the table of subjects, and copied rows"


def test_hearts_are_read_and_refused_in_the_same_words(tmp_path: Path, program: str) -> None:
    paths = []
    for number, (change, _) in enumerate(SUBJECT_TABLE):
        cohort = write_cohort(tmp_path / str(number) / "cohort")
        change(cohort)
        if (cohort / "subjects.csv").is_file():
            paths.append(cohort / "subjects.csv")
    found = in_javascript(tmp_path, program, HEARTS, paths)
    words = [refusal(lambda path=path: dropped_hearts(path)) for path in paths]
    assert [part.get("refused") for part in found] == words
    assert sum(word is not None for word in words) >= 10
    for path, part, word in zip(paths, found, words, strict=True):
        if word is None:
            assert dict(part["read"]) == dropped_hearts(path)

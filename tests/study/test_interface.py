"""The public interface: few names, loaded when asked for, whose examples run as they are printed."""

from __future__ import annotations

import dataclasses
import doctest
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray
from study_copy import ROOT

import swesbi
from swesbi import interface
from swesbi.answers.files import OUTPUTS

VOLUNTEER = "data/virtual_volunteers/swe/G.csv"


@pytest.fixture(autouse=True)
def in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


LIGHT = f"""
import pydoc, sys, swesbi
print(*dir(swesbi), "numpy" in sys.modules, sep="\\n", end="\\f")
print(pydoc.render_doc(swesbi, renderer=pydoc.plaintext), end="\\f")
heart = swesbi.Context("X", "F", 30.0, 1.7, 64.0, 90.0, 34.0, 0.8)
swesbi.simulate_beat([[55.0, 6.0, 28.0]], heart)
swesbi.read_recording("{VOLUNTEER}")
print("torch" in sys.modules)
"""


def test_completion_loads_no_library_and_help_a_beat_and_a_recording_no_torch() -> None:
    done = subprocess.run([sys.executable, "-c", LIGHT], capture_output=True, text=True, check=True)
    listed, shown, torch = done.stdout.split("\f")
    assert listed.splitlines() == [*sorted([*swesbi.__all__, "__version__"]), "False"]
    assert torch == "False\n"
    for name in swesbi.__all__:
        assert re.search(rf"^    (class )?{name}\(", shown, re.MULTILINE)


@pytest.mark.slow(minutes=0.5)
def test_examples_of_docstrings_run_as_printed() -> None:
    result = doctest.testmod(interface)
    assert result.attempted and not result.failed


def test_a_recording_has_one_likelihood_by_its_own_model_and_by_another() -> None:
    recording = swesbi.read_recording(VOLUNTEER, from_prior=True)
    phi = swesbi.torch_prior(recording.prior).sample((20,)).double().numpy()
    predicted = recording.predict(phi)
    again = recording.log_density(predicted.log_speed, predicted.slope)
    np.testing.assert_array_equal(recording.log_likelihood(phi), again)
    made = recording.draw_speeds(phi, seed=1)
    assert made.shape == predicted.log_speed.shape
    np.testing.assert_array_equal(made, recording.draw_speeds(phi, seed=1))
    away = (np.log(made) - predicted.log_speed)[np.isfinite(made)]
    assert 0.5 < away.std() / np.mean(recording.speeds.relative_se) < 3.0


HEART = swesbi.Context("G", "F", 25.0, 1.7, 61.0, 90.0, 34.0, 0.76)
NOISE = {"cv_fraction": 0.1, "cv_log_sd": 0.3}
TRAIN = "data/virtual_push_trains/swe/G.csv"


def test_a_recording_in_memory_is_that_of_its_file() -> None:
    train, gated = pd.read_csv(TRAIN), pd.read_csv(VOLUNTEER)
    of_file = swesbi.read_recording(TRAIN).speeds
    other = train.rename(columns={"time_ms": "Time (s)"}).assign(
        **{"Time (s)": (train["time_ms"] / 1000).round(6)}
    )
    arrays = {name: train[name] for name in ("rr_ms", "beat")}
    speeds = train["shear_wave_speed_m_s"].where(train["status"] == "ok")
    for recording in (
        swesbi.recording_from_table(train, HEART, noise=NOISE),
        swesbi.recording_from_table(other, HEART, noise=NOISE, columns={"time_ms": "Time (s)"}),
        swesbi.recording_from_arrays(train["time_ms"], speeds, context=HEART, noise=NOISE, **arrays),
    ):
        np.testing.assert_array_equal(recording.speeds.phase, of_file.phase)
        np.testing.assert_array_equal(recording.speeds.speed_m_s, of_file.speed_m_s)
        np.testing.assert_array_equal(recording.speeds.relative_se, of_file.relative_se)
    heart = swesbi.read_recording(VOLUNTEER).speeds.context
    alone = swesbi.recording_from_table(gated, heart, protocol={"phases": 20, "repeats_are": "sweeps"})
    np.testing.assert_array_equal(alone.speeds.speed_m_s, swesbi.read_recording(VOLUNTEER).speeds.speed_m_s)


@pytest.mark.parametrize(
    ("change", "said", "words"),
    [
        (lambda t: t.assign(rr_ms=1.1), {}, "row 1, column 'rr_ms': '1.1' is outside .150, 5000."),
        (lambda t: t[:0], {}, "the table in memory: holds no data row"),
        (lambda t: pd.concat([t, t[:1]]), {}, "row 62, .* repeats the beat, time_ms of an earlier row"),
        (lambda t: pd.concat([t, t[["rr_ms"]]], axis=1), {}, "names a column twice: rr_ms"),
        (lambda t: t.assign(time_ms=[[x] for x in t["time_ms"]]), {}, "is not a number"),
        (lambda t: t, {"noise": {}}, "nothing says how large the errors"),
        (lambda t: t, {"noises": NOISE}, "has the key `noises`, which is not known; did you mean `noise`"),
    ],
)
def test_a_table_in_memory_is_refused_as_a_file_is(
    change: Callable[[pd.DataFrame], pd.DataFrame], said: dict[str, object], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        swesbi.recording_from_table(change(pd.read_csv(TRAIN)), HEART, **{"noise": NOISE} | said)


def test_what_is_no_recording_or_no_heart_is_refused() -> None:
    with pytest.raises(ValueError, match=r"G.csv is the recording of G"):
        swesbi.read_recording(VOLUNTEER, subject="B")
    with pytest.raises(TypeError, match="takes a path or a recording, not int"):
        swesbi.infer(7)  # type: ignore[arg-type]
    time, speed = np.arange(9.0), np.full(9, 2.0)
    with pytest.raises(ValueError, match=r"its arrays differ in length \(time_ms 9, rr_ms 8"):
        swesbi.recording_from_arrays(time, speed, rr_ms=np.full(8, 900.0), context=HEART)
    with pytest.raises(ValueError, match="column 'time_ms': is an array of 2 dimensions"):
        swesbi.recording_from_arrays(time[None], speed, rr_ms=time, context=HEART)
    in_litres = dataclasses.replace(HEART, lvedv_ml=0.09)
    with pytest.raises(ValueError, match=r"the context of G: lvedv_ml = 0.09 is outside .*; check its unit"):
        swesbi.recording_from_table(pd.read_csv(TRAIN), in_litres, noise=NOISE)


@pytest.mark.slow(minutes=0.3)
def test_an_answer_is_written_as_the_command_writes_it(tmp_path: Path) -> None:
    recording = swesbi.recording_from_table(pd.read_csv(TRAIN), HEART, noise=NOISE)
    answer = swesbi.infer(recording, out=tmp_path / "answer")
    assert sorted(file.name for file in (tmp_path / "answer").iterdir()) == sorted(OUTPUTS)
    kept = xarray.open_datatree(tmp_path / "answer" / "posterior.h5").posterior
    np.testing.assert_array_equal(kept.k0_kpa, answer.posterior.k0_kpa)
    with pytest.raises(ValueError, match="holds the answer to another recording"):
        swesbi.infer(VOLUNTEER, out=tmp_path / "answer")
    other = swesbi.infer(recording, seed=5, out=tmp_path / "other")
    assert not np.array_equal(other.posterior.k0_kpa, answer.posterior.k0_kpa)


@pytest.mark.slow(minutes=0.6)
@pytest.mark.parametrize(
    ("example", "given", "said"),
    [("own_forward_model", [], "converged"), ("npe_with_sbi", ["600"], "k_sr_per_s")],
)
def test_worked_examples_run_as_they_are(example: str, given: list[str], said: str) -> None:
    command = [sys.executable, f"docs/examples/{example}.py", *given]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].startswith(said)

"""The public interface: few names, loaded when asked for, whose examples run as they are printed."""

from __future__ import annotations

import doctest
import re
import subprocess
import sys

import numpy as np
import pytest
from study_copy import ROOT

import swesbi
from swesbi import interface

VOLUNTEER = "data/virtual_volunteers/swe/G.csv"


@pytest.fixture(autouse=True)
def in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_the_names_are_few_and_all_there() -> None:
    assert len(swesbi.__all__) == 8, "README and docs name eight"
    assert all(getattr(swesbi, name).__doc__ for name in swesbi.__all__)
    with pytest.raises(AttributeError, match="no attribute 'inferr'"):
        _ = swesbi.inferr  # type: ignore[attr-defined]


def test_what_is_no_recording_is_refused_plainly() -> None:
    with pytest.raises(ValueError, match=r"G.csv is the recording of G"):
        swesbi.read_recording(VOLUNTEER, subject="B")
    with pytest.raises(TypeError, match="takes the result of read_recording"):
        swesbi.infer(VOLUNTEER)  # type: ignore[arg-type]


def test_help_and_completion_have_the_names_and_load_no_torch() -> None:
    code = (
        "import pydoc, sys, swesbi; print(*dir(swesbi), 'numpy' in sys.modules, sep='\\n', end='\\f'); "
        "print(pydoc.render_doc(swesbi, renderer=pydoc.plaintext), 'torch' in sys.modules, sep='\\f')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    listed, shown, torch = done.stdout.split("\f")
    assert listed.splitlines() == [*sorted([*swesbi.__all__, "__version__"]), "False"]
    assert torch == "False\n"
    table, _, entries = shown.partition("PACKAGE CONTENTS")
    for name in swesbi.__all__:
        assert f"\n        {name} " in table
        assert re.search(rf"^    (class )?{name}\(", entries, re.MULTILINE)


def test_a_beat_and_a_recording_need_no_torch() -> None:
    code = (
        "import sys, swesbi; heart = swesbi.Context('X', 'F', 30.0, 1.7, 64.0, 90.0, 34.0, 0.8); "
        f"swesbi.simulate_beat([[55.0, 6.0, 28.0]], heart); swesbi.read_recording({VOLUNTEER!r}); "
        "print('torch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


@pytest.mark.slow(minutes=0.5)
def test_examples_of_docstrings_run_as_printed() -> None:
    result = doctest.testmod(interface)
    assert result.attempted
    assert not result.failed


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

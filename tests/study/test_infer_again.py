"""`infer` once more: answers stay, and what a kill left is made good."""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cohorts import ungrouped
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.answers.files import NUMBERS, OUTPUTS, VERDICT, WITH_PRESSURES
from swesbi.artefacts.files import check_whole

SUBJECTS = ("A", "B", "C")
FILES = {*OUTPUTS, WITH_PRESSURES}
OVERLAY = str(ROOT / "tests" / "smoke.yaml")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three recordings of the virtual volunteers."""
    made, shipped = tmp_path / "clinic", ROOT / "data" / "virtual_volunteers"
    (made / "swe").mkdir(parents=True)
    rows = (shipped / "subjects.csv").read_text(encoding="utf-8").splitlines()
    kept = [row for row in rows if row.split(",")[0] in ("subject", *SUBJECTS)]
    (made / "subjects.csv").write_text("\n".join(kept) + "\n", encoding="utf-8")
    (made / "recording.yaml").write_text(ungrouped(shipped), encoding="utf-8")
    for name in SUBJECTS:
        shutil.copy(shipped / "swe" / f"{name}.csv", made / "swe")
    return made


def infer(folder: Path, out: Path, *further: str) -> int:
    given = ["--config", str(ROOT / "config.yaml"), "--overlay", OVERLAY, "--out", str(out), "--from-prior"]
    return main(["infer", str(folder), *given, *further])


def stamps(out: Path) -> dict[str, int]:
    return {str(path): path.stat().st_mtime_ns for path in out.rglob("*/*") if path.is_file()}


@pytest.mark.slow(minutes=0.5)
def test_only_what_has_changed_is_answered_again(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert infer(folder, out) == 0
    before, table = stamps(out), (out / "answers.csv").read_bytes()
    capsys.readouterr()
    assert infer(folder, out, "--figures", "none") == 0
    assert capsys.readouterr().out.count("answered before") == len(SUBJECTS)
    assert stamps(out) == before
    assert (out / "answers.csv").read_bytes() == table
    # a folder with fewer repeats has other noise, and with it every error of its recordings
    path = folder / "swe" / "C.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(lines[: len(lines) - 40]) + "\n", encoding="utf-8")
    # C is another recording, which is not written over
    assert infer(folder, out, "--figures", "sheet") == 2
    assert "C: " in capsys.readouterr().out
    after = stamps(out)
    changed = {Path(name).parent.name for name in after if after[name] != before[name]}
    assert changed == {"A", "B"}
    assert {path.name for path in (out / "A").iterdir()} == {*NUMBERS, "sheet.pdf", WITH_PRESSURES}
    # damaged files: an answer is made again, unless the recording that it was made of cannot be read
    for name in ("A/posterior.h5", "B/observation.h5"):
        with (out / name).open("ab") as file:
            file.write(b"x")
    assert infer(folder, out, "--figures", "none") == 2
    assert re.search(r"B: .*observation\.h5: has no checksum.*; name another", capsys.readouterr().out)
    check_whole(out / "A" / "posterior.h5")


@pytest.mark.slow(minutes=1.5)
def test_a_killed_run_leaves_whole_answers_or_none_and_the_next_goes_on(folder: Path, tmp_path: Path) -> None:
    """Killed as soon as the first answer, as the second lies there, and in the midst of the third."""
    out = tmp_path / "out"
    command = [
        sys.executable, "-m", "swesbi", "infer", str(folder), "--config", str(ROOT / "config.yaml"),
        "--overlay", OVERLAY, "--out", str(out), "--from-prior", "--workers", "1",
    ]  # fmt: skip
    for answered, later_s in ((0, 6.0), (1, 0.0), (2, 1.5)):
        running = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while running.poll() is None and len(whole(out)) < answered:
            time.sleep(0.02)
        time.sleep(later_s)
        running.send_signal(signal.SIGKILL)
        running.wait()
        assert not (out / "answers.csv").exists()
        whole(out)  # what has a verdict has all of its files
    kept = {name: stamp for name, stamp in stamps(out).items() if Path(name).parent.name in SUBJECTS}
    assert infer(folder, out) == 0
    assert whole(out) == set(SUBJECTS)
    assert (out / "answers.csv").is_file()
    done = stamps(out)
    assert kept
    assert {name: done[name] for name in kept} == kept
    assert not [path for path in tmp_path.rglob(".*")]  # nothing of the killed ones is left


def whole(out: Path) -> set[str]:
    """Return which answers lie there with all their files, each as it was written."""
    found = {name for name in SUBJECTS if (out / name / VERDICT).is_file()}
    for name in found:
        assert {path.name for path in (out / name).iterdir()} == FILES
        json.loads((out / name / VERDICT).read_text(encoding="utf-8"))
        for path in (out / name).glob("*.h5"):
            check_whole(path)
    return found

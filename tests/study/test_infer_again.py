"""`infer` once more: answers stay, what a kill left is made good, nothing is read or written twice."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from cohorts import ungrouped
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.answers.files import OUTPUTS, VERDICT, WITH_PRESSURES
from swesbi.artefacts import atomic
from swesbi.artefacts.files import check_whole
from swesbi.recording.tables import csv_text, files

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


def infer(folder: Path, out: Path, *more: str) -> int:
    given = ["--config", str(ROOT / "config.yaml"), "--overlay", OVERLAY, "--out", str(out), "--from-prior"]
    return main(["infer", str(folder), *given, *more])


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
    assert infer(folder, out) == 0
    assert capsys.readouterr().out.count("answered before, and nothing has changed since") == len(SUBJECTS)
    assert stamps(out) == before
    assert (out / "answers.csv").read_bytes() == table
    # a folder with fewer repeats has other noise, and with it every error of its recordings
    path = folder / "swe" / "C.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(lines[: len(lines) - 40]) + "\n", encoding="utf-8")
    assert infer(folder, out) == 2  # C is another recording, which is not written over
    assert "C: " in capsys.readouterr().out
    after = stamps(out)
    changed = {Path(name).parent.name for name in after if after[name] != before[name]}
    assert changed == {"A", "B"}


@pytest.mark.slow(minutes=0.2)
def test_a_recording_s_table_is_parsed_once_and_each_file_is_written_once(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: Counter[str] = Counter()
    real = atomic.atomic_path

    @contextmanager
    def counted(path: Path) -> Iterator[Path]:
        written[path.name] += 1
        with real(path) as temporary:
            yield temporary

    for module in [module for name, module in sys.modules.items() if name.startswith("swesbi")]:
        if getattr(module, "atomic_path", None) is real:
            monkeypatch.setattr(module, "atomic_path", counted)
    parsed = count_parses(monkeypatch)
    assert infer(folder, tmp_path / "out", "--subject", "A") == 0
    # the noise of A is that of its folder, so the other two are read as well
    assert parsed() == {name: 1 for name in SUBJECTS}
    assert {name: written[name] for name in FILES} == dict.fromkeys(FILES, 1)


def count_parses(monkeypatch: pytest.MonkeyPatch) -> Callable[[], dict[str, int]]:
    """Count how often each recording's text is parsed."""
    files._opened.cache_clear()
    counts: Counter[str] = Counter()
    real = csv_text.records

    def records(path: Path, *rest: str) -> object:
        counts[path.stem] += 1
        return real(path, *rest)

    monkeypatch.setattr(csv_text, "records", records)
    return lambda: {name: counts[name] for name in SUBJECTS}


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
        for name in SUBJECTS:
            if (out / name).is_dir() and VERDICT in {path.name for path in (out / name).iterdir()}:
                assert name in whole(out)
    kept = stamps(out)
    assert infer(folder, out) == 0
    assert whole(out) == set(SUBJECTS)
    assert (out / "answers.csv").is_file()
    done = stamps(out)
    assert kept
    assert {name: done[name] for name in kept if Path(name).parent.name in SUBJECTS} == {
        name: stamp for name, stamp in kept.items() if Path(name).parent.name in SUBJECTS
    }
    assert not [path for path in tmp_path.rglob(".*")]  # nothing of the killed ones is left


def whole(out: Path) -> set[str]:
    """Return which answers lie there with all their files, each as it was written."""
    found = set()
    for name in SUBJECTS:
        if not (out / name / VERDICT).is_file():
            continue
        assert {path.name for path in (out / name).iterdir()} == FILES
        json.loads((out / name / VERDICT).read_text(encoding="utf-8"))
        for path in (out / name).glob("*.h5"):
            check_whole(path)
        found.add(name)
    return found

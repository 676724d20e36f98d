"""Processor time and memory of the answer to 1,000 pushes, over those of 60.

    python benchmarks/pushes.py

The model makes the pushes of one heart. Each number of them is answered by `infer` in a process of its own.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.config.view import View
from swesbi.population.recordings import FreshSettings, record_pushes

PUSHES: Final = (60, 1000)
HEART: Final = 3  # number of the population's fresh hearts
SEED: Final = 1
PER_BEAT: Final = 34
DECLARED: Final = "origin: made by the model\nnoise: { cv_fraction: 0.1, cv_log_sd: 0.3 }\n"


def write_cohort(folder: Path, fresh: FreshSettings) -> None:
    """Write a folder of recordings of one heart, a subject for each number of pushes."""
    (folder / "swe").mkdir(parents=True)
    rows = []
    for count in PUSHES:
        recording = record_pushes(HEART, (count, count), fresh, SEED, "benchmark")[0].recording
        context, period_ms = recording.context, 1e3 * recording.context.period_s
        table = pd.DataFrame(
            {
                "time_ms": recording.phase * period_ms,
                "rr_ms": period_ms,
                "beat": np.arange(len(recording.phase)) % max(1, count // PER_BEAT),
                "shear_wave_speed_m_s": recording.speed_m_s,
                "status": "ok",
            }
        )
        table.to_csv(folder / "swe" / f"P{count}.csv", index=False)
        rows.append(asdict(replace(context, subject=f"P{count}")))
    pd.DataFrame(rows).to_csv(folder / "subjects.csv", index=False)
    (folder / "recording.yaml").write_text(DECLARED, encoding="utf-8")


def answered(recording: Path) -> tuple[float, float]:
    """Answer a recording, and return processor seconds and the largest memory so far in GB."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out = recording.parents[1] / "answers" / recording.stem
    command = [sys.executable, "-m", "swesbi", "infer", str(recording), "--out", str(out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, after.ru_maxrss / 1e6


def main() -> None:
    """Print the measured times and their ratio."""
    study = load_study(read_merged(Path("config.yaml")))
    fresh = FreshSettings.from_plain(View(study, {"experiment": "amortised"})["fresh"])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "cohort"
        write_cohort(folder, fresh)
        few, many = (answered(folder / "swe" / f"P{count}.csv") for count in PUSHES)
    for count, (seconds, memory_gb) in zip(PUSHES, (few, many), strict=True):
        print(f"{count} pushes: {seconds:.1f} s of processor time, {memory_gb:.2f} GB")
    print(f"ratio of processor time: {many[0] / few[0]:.1f}")


if __name__ == "__main__":
    main()

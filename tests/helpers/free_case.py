"""Virtual free-running recordings for tests: 34 pushes a second over jittering beats, half lost."""

from __future__ import annotations

from pathlib import Path

import cohorts
import numpy as np
import pandas as pd
import speed_case
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.recording.ingest import ingest_pushes
from swesbi.recording.observation import Observation
from swesbi.recording.reader import samples_in
from swesbi.recording.samples import Samples
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.tables.files import open_table
from swesbi.recording.tables.layout import TableLayout

PUSHES_PER_S = 34.0
NOISE = "noise: { cv_fraction: 0.1, cv_log_sd: 0.3 }\n"
MITRAL_WAVES = "event,rr_ms,beat,shear_wave_speed_m_s\nmvc,985,0,1.25\nmvc,1017,1,1.18\n"
HEART = Context("T", "F", 25.0, 1.7, 60.0, 90.0, 34.0, 0.8)
DECLARED = NoiseDeclaration(cv_fraction=0.1, cv_log_sd=0.3)
QUALITY = speed_case.shipped().recording


def observed(path: Path, layout: TableLayout | None = None, subject: str = "T") -> Observation:
    """Read and ingest a free-running recording of one heart."""
    return ingest_pushes(pushes(path, layout, subject), HEART, QUALITY, DECLARED)


def pushes(path: Path, layout: TableLayout | None = None, subject: str = "") -> Samples:
    """Read a free-running recording."""
    chosen = layout or TableLayout()
    samples = samples_in(open_table(path, chosen), 20, 1000.0, chosen, subject)
    assert not samples.is_gated
    return samples


def curve_m_s(phase: NDArray[np.float64]) -> NDArray[np.float64]:
    """A smooth curve of speeds with a peak in systole."""
    return np.asarray(1.25 + 3.0 * np.exp(-0.5 * ((phase - 0.3) / 0.1) ** 2))


def train(seed: int = 0, beats: float = 1.8, lost: float = 0.46) -> pd.DataFrame:
    """Return a push train, a row a push, with a lost push as a row without speed."""
    rng = np.random.default_rng(seed)
    lengths = 1000.0 * (1.0 + 0.05 * rng.standard_normal(int(np.ceil(beats)) + 1))
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.arange(0.0, beats * 1000.0, 1e3 / PUSHES_PER_S)
    beat = np.searchsorted(starts, at, side="right") - 1
    time, rr = at - starts[beat], lengths[beat]
    speed = curve_m_s(time / rr) * (1.0 + 0.1 * rng.standard_normal(len(at)))
    gone = rng.random(len(at)) < lost
    return pd.DataFrame(
        {
            "time_ms": np.round(time, 2),
            "rr_ms": np.round(rr, 1),
            "beat": beat,
            "shear_wave_speed_m_s": np.where(gone, np.nan, np.round(speed, 3)),
            "status": np.where(gone, "no_wave", "ok"),
        }
    )


def write_free_cohort(folder: Path, rows: dict[str, pd.DataFrame], noise: str = NOISE) -> Path:
    """Write a cohort of free-running recordings in CSV, all of one heart of 60 beats a minute."""
    (folder / "swe").mkdir(parents=True)
    lines = [cohorts.HEADER, *(f"{name},F,25,1.7,60,90,34,0.8" for name in rows)]
    (folder / "subjects.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "recording.yaml").write_text(f"origin: virtual recordings of a test\n{noise}", encoding="utf-8")
    for name, table in rows.items():
        table.to_csv(folder / "swe" / f"{name}.csv", index=False)
    return folder


def mixed(folder: Path) -> Path:
    """A cohort of a gated recording of 20 phases, one of 24 and a free-running one."""
    cohort = cohorts.write_cohort(folder)
    lines = [*cohorts.ROWS.values(), "S-3,F,25,1.7,60,90,34,0.8"]
    (cohort / "subjects.csv").write_text("\n".join([cohorts.HEADER, *lines]) + "\n")
    cohorts.recording(5, 24).to_csv(cohort / "swe" / "s_2x.csv", index=False)
    (cohort / "swe" / "s_2x.yaml").write_text("protocol: { phases: 24, repeats_are: sweeps }\n")
    train(2).to_csv(cohort / "swe" / "S-3.csv", index=False)
    (cohort / "swe" / "S-3.yaml").write_text(NOISE)
    return cohort

"""Whole cohorts made for tests, in every format that is read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray
from recordings import make_samples
from scipy.io import savemat

from data.makers.files import samples_table

HEADER = "subject,sex,age_years,bsa_m2,hr_bpm,lvedv_ml,lvesv_ml,ivsd_cm"
ROWS = {"S-1": "S-1,F,25,1.7,60,90,34,0.8", "s_2x": "s_2x,M,31,1.9,61,110,41,0.9"}
PROTOCOL = (
    "origin: synthetic recordings of a test in $\\us$\ndensity_kg_m3: 1000.0\nprotocol:\n  phases: 20\n"
)


def recording(seed: int = 0, phases: int = 20) -> pd.DataFrame:
    """A recording with noise and a few failed samples, as the table of the CSV format."""
    table = samples_table(make_samples(repeat_sd=0.04, sample_sd=0.08, seed=seed, phases=phases))
    table["shear_wave_speed_m_s"] = table["shear_wave_speed_m_s"].round(3)
    failed = np.random.default_rng(seed).random(len(table)) < 0.05
    table.loc[failed, ["shear_wave_speed_m_s", "fit_r2"]] = np.nan
    table.loc[failed, "status"] = "no_wave"
    return table


def write_cohort(folder: Path) -> Path:
    """A good cohort of two subjects in CSV."""
    (folder / "swe").mkdir(parents=True)
    (folder / "subjects.csv").write_text("\n".join([HEADER, *ROWS.values()]) + "\n", encoding="utf-8")
    (folder / "recording.yaml").write_text(PROTOCOL, encoding="utf-8")
    for seed, subject in enumerate(ROWS):
        recording(seed).to_csv(folder / "swe" / f"{subject}.csv", index=False)
    return folder


def write_overlay(path: Path, cohort: Path, **changes: object) -> Path:
    """A configuration to be merged over config.yaml, for this cohort."""
    path.write_text(yaml.safe_dump({"cohort": str(cohort), "subjects": "all"} | changes), encoding="utf-8")
    return path


def columns(table: pd.DataFrame) -> dict[str, Any]:
    """The columns of a recording as MATLAB would hold them: column vectors, and a cell array of texts."""
    cells = {name: np.asarray(table[name], dtype=float)[:, None] for name in table if name != "status"}
    return cells | {"status": np.array(list(table["status"]), dtype=object)[:, None]}


def write_v5(path: Path, table: pd.DataFrame, struct: str = "") -> None:
    """A .mat file of version 5: vectors, or the fields of one struct."""
    savemat(path, {struct: columns(table)} if struct else columns(table), do_compression=True)


def write_v73(path: Path, table: pd.DataFrame, struct: str = "") -> None:
    """A .mat file of version 7.3, laid out as MATLAB lays it out: HDF5 behind a block of 512 bytes."""
    with h5py.File(path, "w", userblock_size=512) as file:
        group = file
        if struct:
            group = file.create_group(struct)
            group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, value in columns(table).items():
            if value.dtype == object:
                _write_cells(file, group, name, value)
            else:
                dataset = group.create_dataset(name, data=value.T)
                dataset.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def _write_cells(file: h5py.File, group: h5py.Group, name: str, texts: NDArray[np.object_]) -> None:
    references = np.empty(texts.T.shape, dtype=h5py.ref_dtype)
    for index, text in enumerate(texts.ravel()):
        codes = np.frombuffer(text.encode("utf-16-le"), dtype="<u2")[:, None]
        cell = file.create_dataset(f"#refs#/{name}{index}", data=codes)
        cell.attrs["MATLAB_class"] = np.bytes_("char")
        references[0, index] = cell.ref
    dataset = group.create_dataset(name, data=references, dtype=h5py.ref_dtype)
    dataset.attrs["MATLAB_class"] = np.bytes_("cell")


def snapshot(folder: Path) -> Mapping[str, bytes]:
    """Every file below a folder with its content; links and special files by name alone."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b""
        for path in sorted(folder.rglob("*"))
    }


def ungrouped(shipped: Path) -> str:
    """How a folder's recordings were made, without its noise groups, which name all of its subjects."""
    return (shipped / "recording.yaml").read_text(encoding="utf-8").partition("noise_groups:")[0]

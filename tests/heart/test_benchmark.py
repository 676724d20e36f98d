"""The benchmark runs, and says how to get what it could not find."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from study_copy import ROOT

SCRIPT = ROOT / "benchmarks" / "simulator.py"


@pytest.mark.slow
def test_benchmark_prints_its_tables(tmp_path: Path) -> None:
    absent = tmp_path / "python"
    absent.write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')  # an interpreter without packages
    absent.chmod(0o755)
    command = [
        sys.executable,
        str(SCRIPT),
        "--draws",
        "8",
        "--largest",
        "1000",
        "--physioblocks",
        str(absent),
    ]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "pip install physioblocks==2.0.1" in output
    assert "SciPy LSODA, same equations" in output
    ours, scipy = (
        next(line for line in output.splitlines() if line.startswith(name)).split()
        for name in ("this model", "SciPy LSODA")
    )
    error_95, ratio = float(ours[-2]), float(scipy[-5].replace(",", ""))
    assert error_95 < 1e-3
    assert ratio > 20.0
    assert "per second" in output

"""Free-running recordings in the documentation: what the stored tables say is what is written."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from swesbi.artefacts import ArtefactError
from swesbi.parameters import THETA_NAMES
from swesbi.report.csv import write_csv
from tools.docs.pushes import (
    NOT_COMPARED,
    NOT_RUN,
    PushesResults,
    pushes_part,
)


def made_table(pushes: tuple[str, ...] = ("all", "2", "52")) -> pd.DataFrame:
    """Coverages that tell number of pushes, parameter and level from each other."""
    rows = [
        {
            "pushes": number, "parameter": name, "nominal": nominal,
            "coverage": nominal - 0.01 * i - 0.001 * j, "ci_low": 0.5, "ci_high": 0.97, "n": 400,
            "median_efficiency": 0.163, "by_mcmc": 0.005, "false_alarms": 0.0125,
        }
        for i, number in enumerate(pushes)
        for j, name in enumerate(THETA_NAMES)
        for nominal in (0.5, 0.9)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def test_each_number_of_pushes_is_a_row(tmp_path: Path) -> None:
    write_csv(tmp_path / "amortised_pushes.csv", made_table())
    text = pushes_part(PushesResults.read(tmp_path, 0.9))
    rows = [line for line in text.splitlines() if line.startswith("| ")][1:]
    assert [row.split("|")[1].strip() for row in rows] == ["all", "2", "52"]
    cells = [cell.strip() for cell in rows[2].split("|")[2:-1]]
    assert cells == ["400", "88.0 (50 to 97)", "87.9 (50 to 97)", "87.8 (50 to 97)", "16", "0.5", "1.2"]
    assert text.endswith(NOT_COMPARED)


def test_both_doors_are_compared_by_the_mean_and_the_worst(tmp_path: Path) -> None:
    doors = pd.DataFrame({"c2st": [0.48, 0.5, 0.53], "log_likelihoods_differ": [1e-13, 2e-13, 1e-14]})
    write_csv(tmp_path / "gated_as_pushes.csv", doors)
    text = pushes_part(PushesResults.read(tmp_path, 0.9))
    assert text.startswith(NOT_RUN)
    assert "3 gated recordings" in text and "0.503 in the mean and 0.530 at most" in text and "2e-13" in text


def test_a_table_that_is_another_is_refused(tmp_path: Path) -> None:
    write_csv(tmp_path / "amortised_pushes.csv", made_table().drop(columns="by_mcmc"))
    with pytest.raises(ArtefactError, match="lacks the columns by_mcmc"):
        PushesResults.read(tmp_path, 0.9)

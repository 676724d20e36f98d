"""Side studies in their small sizes, on a finished small study."""

import pandas as pd
import pytest
from study_copy import StudyCopy, run_side_study

SHOWN_BYTES = 10_000


@pytest.mark.slow(minutes=0.5)
def test_the_small_choice_of_the_discrepancy_runs(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "discrepancy")
    table = pd.read_csv(found / "discrepancy.csv")
    assert table["subjects"].tolist() == [2] * 4
    assert table["log_evidence"].notna().all()
    assert (found / "discrepancy.png").stat().st_size > SHOWN_BYTES


@pytest.mark.slow(minutes=0.6)
def test_the_small_sensitivity_runs(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "sensitivity")
    table = pd.read_csv(found / "sensitivity.csv")
    assert set(table["variant"]) == {"base", "fixed_physiology", "fixed_scale"}
    assert table["median"].notna().all()
    assert (found / "sensitivity.png").stat().st_size > SHOWN_BYTES


@pytest.mark.slow(minutes=1.0)
def test_the_small_validation_runs(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "validation") / "small_exam"
    n = pd.read_csv(found / "validation.csv").groupby("generator")["n"].max()
    assert n.to_dict() == {
        "a: generator of the study": 2,
        "b: generator of the study with doubled ranges": 2,
        "pooled: all": 4,
    }
    assert (found / "validation.png").stat().st_size > SHOWN_BYTES


@pytest.mark.slow(minutes=1.0)
def test_the_small_nonsense_runs(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "validation", "nonsense")
    table = pd.read_csv(found / "nonsense.csv")
    assert (
        len(table) == 19 and (table.drop(columns=["change", "form", "named", "near"]).sum(axis=1) == 1).all()
    )

"""The choice of the discrepancy: its stage, its figure, and what its stored table says of the one in use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from scipy.stats import binom
from study_copy import ROOT

from studies.discrepancy import stages
from studies.discrepancy.settings import ChoiceSettings, choice_settings
from swesbi.config.read import ConfigError, parse_section, read_merged, read_yaml
from swesbi.config.study import load_study
from swesbi.study.job import run_stage

FOLDER = Path(__file__).parents[1]
SECTION = read_yaml(FOLDER / "config.yaml")["discrepancy"]
CHOICE = parse_section(SECTION, "discrepancy", ChoiceSettings)
TABLE = pd.read_csv(FOLDER / "tables" / "discrepancy.csv")
FILES = {"table": ".csv", "figure_pdf": ".pdf", "figure_png": ".png"}
SMALL = {
    "subjects": 2,
    "speed_fractions": [0.0, 0.03],
    "timing_cycles": [0.0, 0.015],
    "simulations_per_round": 400,
    "max_rounds": 12,
    "min_effective_draws": 60,
}


def shipped() -> dict[str, Any]:
    return read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}


def test_the_stage_writes_table_and_figure_and_repeats(tmp_path: Path) -> None:
    raw = shipped()
    del raw["priors"]["calibrated"]["nuisances"]  # without them fewer draws do
    plain = choice_settings(load_study(raw), parse_section(SECTION | SMALL, "discrepancy", ChoiceSettings))
    tables = []
    for name in ("one", "two"):
        files = {key: [tmp_path / f"{name}{suffix}"] for key, suffix in FILES.items()}
        run_stage(stages.discrepancy, {}, files, plain | {"seed": 7, "subject": "", "code": "c"})
        assert all(path.stat().st_size > 0 for (path,) in files.values())
        tables.append(files["table"][0].read_bytes())
    assert tables[0] == tables[1]
    table = pd.read_csv(tmp_path / "one.csv")
    assert len(table) == 4
    assert table["subjects"].tolist() == [2] * 4
    assert (table["min_effective_draws"] >= 60).all()


def test_the_configured_discrepancy_covers_in_the_stored_table_and_evidence_asks_for_less() -> None:
    """Coverage within what chance allows of the nominal one; evidence asks for none, and no timing error."""
    config = load_study(shipped()).config
    chosen = config.speed_experiments[CHOICE.experiment].observation_model.discrepancy
    by_pair = TABLE.set_index(["speed_fraction", "timing_cycle"])
    least = binom.ppf(0.025, CHOICE.subjects, CHOICE.interval) / CHOICE.subjects
    in_use = (chosen.speed_fraction, chosen.timing_cycle)
    assert by_pair.filter(like="coverage_").loc[in_use].min() >= least
    assert by_pair["log_evidence"].idxmax() == by_pair["best"].idxmax() == (0.0, 0.0)
    assert by_pair["log_evidence"].loc[chosen.speed_fraction].idxmax() == chosen.timing_cycle
    assert TABLE["subjects"].unique().tolist() == [CHOICE.subjects]
    grid = [(one.speed_fraction, one.timing_cycle) for one in CHOICE.pairs]
    assert grid == list(zip(TABLE["speed_fraction"], TABLE["timing_cycle"], strict=True))


def test_the_discrepancy_chosen_already_does_not_matter() -> None:
    raw = shipped()
    before = choice_settings(load_study(raw), CHOICE)
    chosen = raw["experiments"]["calibrated"]["observation_model"]["discrepancy"]
    chosen["speed_fraction"] = 0.123
    assert choice_settings(load_study(raw), CHOICE) == before


def test_a_wrong_choice_is_refused_by_its_key() -> None:
    study = load_study(shipped())
    with pytest.raises(ConfigError, match="discrepancy.experiment = 'paper' is no experiment of kind speeds"):
        choice_settings(study, CHOICE.model_copy(update={"experiment": "paper"}))
    with pytest.raises(ConfigError, match="max_round = 3.*did you mean 'max_rounds'"):
        parse_section(SECTION | {"max_round": 3}, "discrepancy", ChoiceSettings)

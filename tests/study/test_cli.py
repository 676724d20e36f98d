"""The stages from the command line, without Snakemake."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.artefacts import load
from swesbi.study.registry import STAGES
from swesbi.study.stages_command import listing

RECORDING = "data/virtual_volunteers/swe/A.csv"


@pytest.fixture(autouse=True)
def in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_ingest_and_passive_run_by_hand(tmp_path: Path) -> None:
    observation, passive = tmp_path / "observation.h5", tmp_path / "passive.h5"
    common = ["--subject", "A", "--overlay", "tests/smoke.yaml", "--observation", str(observation)]
    assert main(["stages", "ingest", *common, "--recording", RECORDING]) == 0
    assert main(["stages", "passive", *common, "--passive", str(passive)]) == 0
    _, provenance = load(passive, "passive")
    assert provenance.subject == "A"
    assert provenance.code_hash


def test_every_stage_s_options_are_distinct_and_a_shard_is_made_by_its_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for stage in STAGES:
        with pytest.raises(SystemExit) as ended:
            main(["stages", stage, "--help"])
        assert ended.value.code == 0, stage
    assert "--shard-number NUMBER" in capsys.readouterr().out
    shard = tmp_path / "shard.h5"
    chosen = ["--subject", "A", "--prior", "paper", "--overlay", "tests/smoke.yaml", "--shard", str(shard)]
    assert main(["stages", "simulate", *chosen]) == 2
    assert "say which shard: --shard-number NUMBER" in capsys.readouterr().err
    assert main(["stages", "simulate", *chosen, "--shard-number", "0"]) == 0
    assert load(shard, "simulations")[1].subject == "A"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["ingest", "--recording", RECORDING], "say which subject: --subject NAME"),
        (["ingest", "--recording", RECORDING, "--subject", "Z"], "subject = 'Z': unknown; the study has A"),
        (["ingest", "--recording", "nowhere.csv", "--subject", "A"], "nowhere.csv"),
        (["ingest", "--recording", RECORDING, "--config", "nowhere.yaml"], "nowhere.yaml"),
    ],
)
def test_input_that_cannot_be_used_ends_with_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    output = tmp_path / "observation.h5"
    assert main(["stages", *arguments, "--observation", str(output)]) == 2
    assert message in capsys.readouterr().err
    assert not output.exists()


def test_the_list_of_stages_names_each_once() -> None:
    named = [line.split()[0] for line in listing().splitlines() if line.startswith("  ")]
    assert sorted(named) == sorted(STAGES)

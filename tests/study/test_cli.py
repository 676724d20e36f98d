"""The command line: what `--help` costs and says, and the stages without Snakemake."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from study_copy import ROOT

from swesbi import __version__
from swesbi.__main__ import COMMANDS, main
from swesbi.artefacts import load
from swesbi.study.registry import STAGES, listing

RECORDING = "data/virtual_volunteers/swe/A.csv"
LIBRARIES = ("numpy", "pandas", "scipy", "pydantic", "h5py", "matplotlib", "torch", "xarray", "snakemake")
HELP_OF_ALL = f"""
import contextlib, sys
from swesbi.__main__ import COMMANDS, main
for command in ([], *([name] for name in COMMANDS)):
    with contextlib.suppress(SystemExit):
        main([*command, "--help"])
print(*[name for name in {LIBRARIES} if name in sys.modules], file=sys.stderr)
"""


@pytest.fixture(autouse=True)
def in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_the_help_of_every_command_imports_no_library_and_prints_single_signs() -> None:
    run = subprocess.run([sys.executable, "-c", HELP_OF_ALL], capture_output=True, text=True, check=True)
    assert run.stderr == "\n"
    assert run.stdout.count("usage: swesbi") == 1 + len(COMMANDS)
    assert "k_sr=-20% " in run.stdout and "%%" not in run.stdout


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert (ended.value.code, capsys.readouterr().out) == (0, f"swesbi {__version__}\n")


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

"""The command line: what `--help` costs and says; a job without Snakemake."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from rules import run_rule
from study_copy import ROOT

from swesbi import __version__
from swesbi.__main__ import COMMANDS, main
from swesbi.config.read import ConfigError, read_merged
from swesbi.config.study import load_study
from swesbi.heart.prior_simulations import PriorSimulations

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


def test_a_job_makes_an_artefact_that_names_its_subject_and_its_code(tmp_path: Path) -> None:
    shard = tmp_path / "shard.h5"
    study = load_study(read_merged(ROOT / "config.yaml", ROOT / "tests" / "smoke.yaml"))
    run_rule("simulate", study, {}, {"shard": shard}, subject="A", prior="paper", shard="0")
    provenance = PriorSimulations.load(shard)[1]
    assert (provenance.subject, provenance.seed, provenance.code_hash) == ("A", study.config.seed, "0")
    assert provenance.settings["prior"] == study.config.priors["paper"].to_plain()


@pytest.mark.parametrize(
    ("wildcards", "message"),
    [({}, "say which subject"), ({"subject": "Z"}, "subject = 'Z': unknown; the study has A")],
)
def test_a_wildcard_that_names_nothing_is_refused(
    tmp_path: Path, wildcards: dict[str, str], message: str
) -> None:
    study, output = load_study(read_merged(ROOT / "config.yaml")), tmp_path / "observation.h5"
    with pytest.raises(ConfigError, match=message):
        run_rule("ingest", study, {"table": Path(RECORDING)}, {"observation": output}, **wildcards)
    assert not output.exists()

"""Subjects outside the pool: who is answered, who is refused, and that others change no answer."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import free_case
import numpy as np
import pandas as pd
import pytest
from cohorts import snapshot, ungrouped
from study_copy import StudyCopy

from swesbi.__main__ import main
from swesbi.answers.files import OUTPUTS, WITH_PRESSURES
from swesbi.artefacts import Provenance
from swesbi.checks.predictive import FreePredictiveCheck
from swesbi.context import Context
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.parameters import REPORTED_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.observation import Observation
from swesbi.study import results
from swesbi.verdict.context import nearest_known, outside, refusal

A = Context("A", "M", 24.0, 1.88, 57.0, 118.0, 45.0, 0.88)
B = Context("B", "F", 27.0, 1.68, 64.0, 84.0, 31.0, 0.74)
MARGIN = 0.1
Typed = Callable[..., subprocess.CompletedProcess[str]]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lvedv_ml": 100.0, "hr_bpm": 60.0}, ()),
        ({"hr_bpm": 64.0 * 1.0999}, ()),
        ({"hr_bpm": 70.5}, ("hr_bpm = 70.5 lies outside 51.3 to 70.4 (they have 57 to 64)",)),
        ({"ivsd_cm": 0.5}, ("ivsd_cm = 0.5 lies outside 0.666 to 0.968 (they have 0.74 to 0.88)",)),
        ({"lvedv_ml": 75.0}, ("lvedv_ml = 75 lies outside 75.6 to 129.8 (they have 84 to 118)",)),
    ],
)
def test_a_value_beyond_those_trained_on_is_named_with_what_is_accepted(
    changes: dict[str, float], words: tuple[str, ...]
) -> None:
    assert outside(replace(A, **changes), [A, B], MARGIN) == words


def test_a_refusal_lists_every_value_with_who_was_trained_on_and_what_to_do() -> None:
    said = refusal(replace(A, lvedv_ml=180.0, hr_bpm=130.0), [A, B], MARGIN)
    assert "trained on the contexts of A, B, and" in said
    assert "\n  - hr_bpm = 130 lies outside 51.3 to 70.4" in said and "\n  - lvedv_ml = 180 lies" in said
    assert "rerun it, which trains a network" in said


def test_what_only_steers_the_network_is_shown_to_it_as_the_nearest_value_that_it_knows() -> None:
    old = replace(A, sex="F", age_years=60.0, bsa_m2=1.7, lvesv_ml=60.0)
    assert outside(old, [A], MARGIN) == ()
    assert nearest_known(old, [A]) == A
    assert nearest_known(replace(old, age_years=25.0), [A, B]) == replace(old, age_years=25.0, lvesv_ml=45.0)
    fast = replace(A, hr_bpm=1.05 * A.hr_bpm)
    assert nearest_known(fast, [A]) == fast


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Typed:
    """Runs `infer` in this process, in the folder of a small study and under its configuration."""

    def run(study: StudyCopy, *arguments: str) -> subprocess.CompletedProcess[str]:
        with monkeypatch.context() as patch:
            patch.chdir(study.folder)
            code = main(["infer", "--overlay", study.config, *arguments])
        shown = capsys.readouterr()
        return subprocess.CompletedProcess(arguments, code, shown.out, shown.err)

    return run


@pytest.fixture
def refused(typed: Typed, finished: StudyCopy) -> Typed:
    """The same on the finished study, for what is refused before anything is computed."""
    return partial(typed, finished)


def test_mistakes_are_told_before_anything_runs_and_nothing_is_written(
    refused: Typed, finished: StudyCopy, tmp_path: Path
) -> None:
    shipped = finished.folder / "data" / "virtual_volunteers"
    cohort = tmp_path / "other"
    (cohort / "swe").mkdir(parents=True)
    table = pd.read_csv(shipped / "subjects.csv").set_index("subject", drop=False).loc[["C"]]
    table.assign(ivsd_cm=1.4).to_csv(cohort / "subjects.csv", index=False)
    (cohort / "recording.yaml").write_text(ungrouped(shipped), encoding="utf-8")
    (cohort / "swe" / "C.csv").write_bytes((shipped / "swe" / "C.csv").read_bytes())
    (tmp_path / "alone.csv").touch()
    before = snapshot(tmp_path)
    to = ("--experiment", "calibrated", "--out", str(tmp_path / "out"))
    for asked, words in (
        ((str(shipped), "--subject", "Z"), "subject = 'Z'"),
        (
            (str(tmp_path / "none"), "--subject", "C"),
            "none: there is no such file or folder; a recording lies in FOLDER/swe/",
        ),
        ((str(tmp_path / "alone.csv"),), "no subjects.csv stands above it"),
        ((str(cohort), "--subject", "C"), "this one:\n  - ivsd_cm = 1.4 lies outside 0.576 to 0.968"),
    ):
        done = refused(*asked, *to)
        assert done.returncode == 2
        assert words in done.stderr
    assert snapshot(tmp_path) == before


def overlay_of(finished: StudyCopy, path: Path, results: str | Path, more: str = "") -> str:
    """Write the study's overlay with other results, as seen from its own folder, and further settings."""
    smoke = (finished.folder / finished.config).read_text(encoding="utf-8")
    path.write_text(smoke.replace("results: results-smoke", f"results: {results}") + more, encoding="utf-8")
    return str(path)


def test_a_study_that_has_not_been_run_is_named_with_the_command(
    refused: Typed, finished: StudyCopy, tmp_path: Path
) -> None:
    overlay = overlay_of(finished, tmp_path / "other.yaml", "results-other")
    asked = ("data/virtual_volunteers", "--subject", "C", "--experiment", "calibrated")
    done = refused(*asked, "--overlay", overlay)
    assert done.returncode == 2
    assert "has not been run this far" in done.stderr
    command = done.stderr.splitlines()[-1].strip()
    assert f"snakemake --cores 2 {tmp_path / 'results-other'}/calibrated/flow.h5 " in command
    assert command.endswith(f" --configfile {overlay}")


def test_a_setting_that_is_null_is_one_that_is_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A network that was trained before there was a setting knows it not; its being null says the same."""
    stage = results
    known = {"theta": {"low": 1.0}, "scale": 2.0}
    monkeypatch.setattr(TrainedFlow, "load", lambda _: ({}, Provenance("flow", settings=known)))
    stage.check_network(tmp_path, {"theta": {"low": 1.0, "factor": None}, "scale": 2.0})
    with pytest.raises(stage.OtherNetworkError, match="trained with theta.factor = None, the configuration"):
        stage.check_network(tmp_path, {"theta": {"low": 1.0, "factor": 0.5}, "scale": 2.0})


def test_a_network_of_other_settings_is_refused(refused: Typed, finished: StudyCopy, tmp_path: Path) -> None:
    changed = "forward_model:\n  length_dependence: 0.5\n"
    overlay = overlay_of(finished, tmp_path / "other.yaml", finished.results, changed)
    asked = ("--subject", "C", "--overlay", overlay, "--out", str(tmp_path / "out"))
    done = refused("data/virtual_volunteers", *asked)
    assert done.returncode == 2
    assert "with model.forward_model.length_dependence = 0.0, the configuration has 0.5" in done.stderr
    assert not (tmp_path / "out").exists()


SAME = ("observation.h5", "posterior.h5", "verdict.json", "predictive.h5")


@pytest.mark.slow(minutes=2)
def test_strangers_are_answered_alone_as_among_others(
    typed: Typed, own_study: StudyCopy, tmp_path: Path
) -> None:
    """A gated subject, two free-running ones, two who are refused; of the study nothing reruns."""
    study, out = own_study, tmp_path / "all"
    cohort = strangers(tmp_path / "strangers", study.folder / "data" / "virtual_volunteers")
    given = (str(cohort),)
    assert typed(study, *given, "--workers", "2", "--out", str(out)).returncode == 2
    tables = {"answers.csv", "answers_columns.csv", "answers.xlsx"}
    assert {path.name for path in out.iterdir()} == {"C", "T1", "T3", *tables}
    check_table(pd.read_csv(out / "answers.csv").set_index("subject"))
    check_free(out / "T1")
    for name, further in {"C": WITH_PRESSURES, "T1": "sheet.pdf", "T3": "sheet.pdf"}.items():
        asked = (str(cohort), "--subject", name, "--out", str(tmp_path / "alone"))
        done = study.call("-m", "swesbi", "infer", "--overlay", study.config, *asked)
        assert done.returncode == 0, done.stderr
        for file in (*SAME, further):
            alone = (tmp_path / "alone" / name / file).read_bytes()
            assert alone == (out / name / file).read_bytes(), (name, file)
    apart = tmp_path / "apart"
    asked = ("--subject", "C", "--experiment", "amortised", "--out", str(apart))
    by_population = typed(study, *given, *asked)
    assert by_population.returncode == 0, by_population.stderr
    check_gated(apart / "C", by_population.stdout)
    # whatever network an answer begins with, the prior's band is the prior's
    prior = tmp_path / "prior"
    asked = ("--subject", "T1", "--experiment", "calibrated", "--out", str(prior))
    assert typed(study, *given, *asked).returncode == 0
    by_network, from_prior = (
        FreePredictiveCheck.read(each / "T1" / "predictive.h5") for each in (out, prior)
    )
    np.testing.assert_array_equal(by_network.prior.high, from_prior.prior.high)
    assert not np.array_equal(by_network.posterior.high, from_prior.posterior.high)
    assert study.planned("all") == set()


def strangers(folder: Path, shipped: Path) -> Path:
    """A cohort of C of the volunteers, pushes for a network, lost ones, a thick heart's, and mitral waves."""
    (folder / "swe").mkdir(parents=True)
    header, *rows = (shipped / "subjects.csv").read_text(encoding="utf-8").splitlines()
    lines = [header, *(row for row in rows if row.startswith("C,"))]
    usual = "90,34,0.8"
    volumes_ml_and_septum_cm = {"T1": usual, "T2": usual, "T3": "90,75,2.2", "T4": usual}
    lines += [f"{name},F,25,1.7,60,{values},,," for name, values in volumes_ml_and_septum_cm.items()]
    (folder / "subjects.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "recording.yaml").write_text(ungrouped(shipped), encoding="utf-8")
    (folder / "swe" / "C.csv").write_bytes((shipped / "swe" / "C.csv").read_bytes())
    pushes = {"T1": free_case.train(3).iloc[::4], "T3": free_case.train(8).iloc[::4]}
    for name, table in {**pushes, "T2": free_case.train(2, lost=1.0)}.items():
        table.to_csv(folder / "swe" / f"{name}.csv", index=False)
    (folder / "swe" / "T4.csv").write_text(free_case.MITRAL_WAVES, encoding="utf-8")
    for name in volumes_ml_and_septum_cm:
        (folder / "swe" / f"{name}.yaml").write_text(free_case.NOISE, encoding="utf-8")
    return folder


def check_table(answers: pd.DataFrame) -> None:
    """Each has a row, with the reason of those who have no answer."""
    status = answers["status"].to_dict()
    assert status.pop("C") in ("not contradicted", "doubtful", "contradicted")
    assert status.pop("T1") in ("not contradicted", "doubtful", "contradicted")
    # a septum of 2.2 cm leaves T3 an end-systolic volume of a few mL, 75 were measured
    assert status == {"T2": "refused", "T3": "contradicted", "T4": "refused"}
    assert answers["experiment"].loc[["T1", "T3", "C"]].tolist() == ["amortised", "calibrated", "calibrated"]
    assert "0 pushes are acceptable" in str(answers.loc["T2", "reason"])
    assert "natural waves are not interpreted" in str(answers.loc["T4", "reason"])


def check_gated(out: Path, said: str) -> None:
    """A gated subject has all files, a verdict by all tests, and a sampling check."""
    assert {path.name for path in out.iterdir()} == {*OUTPUTS, WITH_PRESSURES}
    verdict = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    names = {test["name"] for test in verdict["tests"]}
    assert {"noise", "residuals", "context_ranges", "context_leave_one_out"} <= names
    assert said.startswith(f"C: {verdict['sentence']}")
    assert "sampling check passed: draws by" in said and "k_atp_per_s" in said
    for name in ("ppc.png", "posterior.png"):
        assert (out / name).read_bytes().startswith(b"\x89PNG")
    assert "with cuff pressures 130 / 90 mmHg (by " in said


def check_free(out: Path) -> None:
    """A free-running subject has all files, and a verdict by the tests that its pushes allow."""
    assert {path.name for path in out.iterdir()} == set(OUTPUTS)
    verdict = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    assert verdict["sentence"].startswith(verdict["status"])
    names = [test["name"] for test in verdict["tests"]]
    assert names[:4] == ["residuals", "boundary_mass", "end_diastolic_volume", "end_systolic_volume"]
    assert {"context_ranges", "context_leave_one_out", "network"} <= set(names)
    assert names[-len(REPORTED_NAMES) :] == [f"contraction_{name}" for name in REPORTED_NAMES]
    posterior = ExactPosterior.read(out / "posterior.h5")
    assert posterior.converged
    assert verdict["answer"]["k0_kpa"]["median"] == pytest.approx(np.median(posterior.phi[:, 0]))
    assert Observation.read(out / "observation.h5").errors_from == "declared"
    check = FreePredictiveCheck.read(out / "predictive.h5")
    assert check.coverage >= 0.6
    assert (check.posterior.high - check.posterior.low).mean() < (check.prior.high - check.prior.low).mean()

"""Sitting the exam: what is refused, that a stopped run goes on, that answers are those of `new-subject`."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pandas as pd
import pytest
from exam_case import answer
from study_copy import ROOT, StudyCopy

from swesbi.__main__ import main
from swesbi.artefacts import save
from swesbi.config.read import read_merged
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study
from swesbi.exam.recorded import record_heart
from swesbi.exam.score import KIND, read_answers, to_dataset
from swesbi.posterior.result import read_exact_result
from swesbi.study import exam as command
from swesbi.study.new_subject import finished_population
from swesbi.study.stages import exam, exam_table
from swesbi.study.stages.origin import Origin
from swesbi.verdict.answers import status
from swesbi.verdict.support import read_support

STREAM = "development"


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["exam", *arguments]) == 2
    return capsys.readouterr().err


def test_what_cannot_be_sat_is_named_before_anything_runs(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(ROOT)
    overlay = tmp_path / "none.yaml"
    overlay.write_text(f"results: {tmp_path}/none\n", encoding="utf-8")
    given = ("--overlay", str(overlay))
    assert "'z' does not sit the exam; those are a, b" in refused(capsys, "--generators", "z", *given)
    assert "number = 0: at least one" in refused(capsys, "--number", "0", *given)
    assert "configured is exam.experiment = 'amortised'" in refused(capsys, "--experiment", "paper", *given)
    assert "estimator.pt does not exist" in refused(capsys, *given)
    with pytest.raises(SystemExit):
        main(["exam", "--noise", "louder", *given])
    assert "invalid choice: 'louder'" in capsys.readouterr().err


def test_each_level_of_noise_has_answers_and_tables_of_its_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    overlay = tmp_path / "results.yaml"
    overlay.write_text(f"results: {tmp_path}\n", encoding="utf-8")
    asked: list[tuple[str, dict[str, Any]]] = []
    real_stage = command.stage_function

    def stage_of(name: str) -> Callable[..., None]:
        def run(**arguments: object) -> None:
            asked.append((name, arguments))

        run.__annotations__["settings"] = get_type_hints(real_stage(name))["settings"]
        return run

    monkeypatch.setattr(command, "stage_function", stage_of)
    monkeypatch.setattr(command, "check_finished", lambda *_: None)
    assert main(["exam", "--generators", "a", "e", "--overlay", str(overlay)]) == 0
    answered = [files for name, files in asked if name == "exam_answers"]
    folder = tmp_path / "amortised" / "exam"
    assert [files["answers"].relative_to(folder).as_posix() for files in answered] == [
        "cohort/a.h5", "cohort/e.h5", "former/a.h5", "former/e.h5"
    ]  # fmt: skip
    assert [files["settings"].noise for files in answered] == ["cohort", "cohort", "former", "former"]
    sample_sd = [files["settings"].source.acquisition.sample_sd_fraction for files in answered]
    assert sample_sd == pytest.approx([0.06, 0.06, 0.08, 0.08])
    tables = [files for name, files in asked if name == "exam_table"]
    assert [files["table"].name for files in tables] == ["exam.csv", "exam_former_noise.csv"]
    assert [files["samplers"].name for files in tables][1] == "exam_former_noise_samplers.csv"
    assert [path.parent.name for path in tables[1]["answers"]] == ["former", "former"]
    assert "exam_former_noise.csv" in capsys.readouterr().out


def test_a_table_of_two_levels_of_noise_is_refused(tmp_path: Path) -> None:
    loaded = load_study(read_merged(ROOT / "config.yaml", None))
    paths = [tmp_path / f"{noise}.h5" for noise in ("cohort", "former")]
    for path in paths:
        plain = stage_settings(loaded, "exam_answers", generator="a", noise=path.stem)
        settings = exam.ExamAnswersStageSettings.from_plain(plain)
        save(path, to_dataset([answer()]), Origin(5, "", "code").provenance(KIND, settings))
    files = {name: tmp_path / name for name in ("table", "samplers", "figure_pdf", "figure_png")}
    shown = exam_table.ExamTableStageSettings.from_plain(stage_settings(loaded, "exam_table"))
    with pytest.raises(ValueError, match=r"one level of noise, found 2 \(cohort, former\)"):
        exam_table.exam_table(answers=paths, **files, settings=shown, origin=Origin(5, "", "code"))
    assert not files["table"].exists()


def made_settings(study: StudyCopy, letter: str, hearts: int) -> exam.ExamAnswersStageSettings:
    loaded = load_study(read_merged(study.folder / "config.yaml", study.folder / study.config))
    plain = stage_settings(loaded, "exam_answers", generator=letter, stream=STREAM) | {"hearts": hearts}
    return exam.ExamAnswersStageSettings.from_plain(plain)


@pytest.mark.slow(minutes=3)
def test_a_stopped_run_goes_on_and_gives_what_one_run_gives(
    finished: StudyCopy, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished.folder)
    inputs, origin = vars(finished_population(finished.results, "amortised")), Origin(5, "", "code")
    caplog.set_level(logging.INFO, logger="swesbi")
    stopped, whole = tmp_path / "stopped" / "z.h5", tmp_path / "whole" / "z.h5"
    exam.exam_answers(**inputs, answers=stopped, settings=made_settings(finished, "z", 1), origin=origin)
    exam.exam_answers(
        **inputs, answers=stopped, settings=made_settings(finished, "z", 3), origin=origin, processes=2
    )
    assert "heart 2/2" in caplog.text
    exam.exam_answers(**inputs, answers=whole, settings=made_settings(finished, "z", 3), origin=origin)
    assert stopped.read_bytes() == whole.read_bytes()
    caplog.clear()
    other = replace(origin, code_hash="other code")
    exam.exam_answers(**inputs, answers=stopped, settings=made_settings(finished, "z", 1), origin=other)
    assert "is made anew" in caplog.text
    files = {name: tmp_path / f"{name}.csv" for name in ("table", "samplers")}
    files |= {f"figure_{kind}": tmp_path / f"exam.{kind}" for kind in ("pdf", "png")}
    loaded = load_study(read_merged(finished.folder / "config.yaml", finished.folder / finished.config))
    shown = exam_table.ExamTableStageSettings.from_plain(stage_settings(loaded, "exam_table"))
    exam_table.exam_table(answers=[whole], **files, settings=shown, origin=origin)
    assert pd.read_csv(files["table"])["generator"].unique().tolist() == ["z: structure of development"]
    assert files["figure_png"].read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow(minutes=2)
def test_a_heart_is_answered_as_a_subject_outside_the_study_is(
    finished: StudyCopy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished.folder)
    settings = made_settings(finished, "a", 1)
    study = load_study(read_merged(finished.folder / "config.yaml", finished.folder / finished.config))
    made = record_heart(
        settings.source,
        0,
        study.config.seed,
        STREAM,
        settings.recording,
        settings.grid_points,
        settings.clinical.errors,
    )
    subject, cohort = made.heart.context.subject, tmp_path / "cohort"
    (cohort / "swe").mkdir(parents=True)
    whole = {"trigger_delay_ms": np.int64, "rr_ms": np.int64}
    made.samples.frame().astype(whole).to_csv(cohort / "swe" / f"{subject}.csv", index=False)
    pd.DataFrame([asdict(made.heart.context)]).to_csv(cohort / "subjects.csv", index=False)
    (cohort / "recording.yaml").write_text(
        "origin: a heart of development\nprotocol: { repeats_are: sweeps }\n", encoding="utf-8"
    )
    out = tmp_path / "out"
    done = finished.call(
        *("-m", "swesbi", "new-subject", "--overlay", finished.config, "--experiment", "amortised"),
        *("--cohort", str(cohort), "--subject", subject, "--out", str(out)),
    )
    assert done.returncode == 0, done.stderr
    inputs = vars(finished_population(finished.results, "amortised"))
    path = tmp_path / "a.h5"
    exam.exam_answers(**inputs, answers=path, settings=settings, origin=Origin(study.config.seed, "", "code"))
    (found,) = read_answers(path)
    exact = read_exact_result(out / "posterior.h5")
    assert found.status == status(read_support(out / "support.json"))
    assert found.efficiency == exact.efficiency
    low, high = np.quantile(exact.phi[:, 0], [0.05, 0.95])
    assert (found.low[2], found.high[2]) == (low, high)

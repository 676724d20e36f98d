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
from swesbi.config.study import Study, load_study
from swesbi.draws import interval_levels
from swesbi.exam.recorded import RecordedHeart
from swesbi.exam.score import KIND, HeartAnswer, read_answers, refusal, to_dataset
from swesbi.posterior.result import read_exact_result
from swesbi.study import exam as command
from swesbi.study.finished import finished_population
from swesbi.study.registry import stage_function
from swesbi.study.stages import exam, exam_pressures, exam_table
from swesbi.study.stages.origin import Origin
from swesbi.verdict.answers import status
from swesbi.verdict.support import read_support
from swesbi.virtual_cohort.files import samples_table

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
    assert "flow.h5 does not exist" in refused(capsys, *given)
    with pytest.raises(SystemExit):
        main(["exam", "--noise", "louder", *given])
    assert "invalid choice: 'louder'" in capsys.readouterr().err


def test_each_level_of_noise_has_answers_and_tables_of_its_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = asked_of(["--generators", "a", "e"], monkeypatch, tmp_path)
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


def test_with_pressures_answers_and_tables_stand_beside_those_without(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = asked_of(["--generators", "a", "--pressures"], monkeypatch, tmp_path)
    ((name, files), (_, tabulated)) = asked
    folder = tmp_path / "amortised" / "exam"
    assert name == "exam_pressures"
    assert files["without"] == folder / "cohort" / "a.h5"
    assert files["answers"] == folder / "cohort_pressures" / "a.h5"
    assert files["settings"].noise == "cohort"
    assert tabulated["answers"] == [files["answers"]]
    assert tabulated["table"] == tmp_path / "tables" / "exam_pressures.csv"
    assert tabulated["samplers"].name == "exam_pressures_samplers.csv"
    assert tabulated["figure_png"] == tmp_path / "figures" / "exam_pressures.png"
    assert tabulated["settings"].pressures
    assert "exam_pressures.csv" in capsys.readouterr().out
    both = asked_of(["--generators", "a", "--pressures", "--noise", "former"], monkeypatch, tmp_path)
    assert both[0][1]["answers"] == folder / "former_pressures" / "a.h5"
    assert both[1][1]["table"].name == "exam_pressures_former_noise.csv"


def asked_of(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> list[tuple[str, dict[str, Any]]]:
    """Return which stages a sitting runs, with what; none of them is run."""
    overlay = tmp_path / "results.yaml"
    overlay.write_text(f"results: {tmp_path}\n", encoding="utf-8")
    asked: list[tuple[str, dict[str, Any]]] = []

    def stage_of(name: str) -> Callable[..., None]:
        def run(**files: object) -> None:
            asked.append((name, files))

        run.__annotations__["settings"] = get_type_hints(stage_function(name))["settings"]
        return run

    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(command, "stage_function", stage_of)
    monkeypatch.setattr(command, "check_finished", lambda *_: None)
    assert main(["exam", *arguments, "--overlay", str(overlay)]) == 0
    return asked


def pressures_settings(hearts: int) -> exam.ExamAnswersStageSettings:
    loaded = load_study(read_merged(ROOT / "config.yaml", None))
    plain = stage_settings(loaded, "exam_pressures", generator="a", stream=STREAM) | {"hearts": hearts}
    return exam.ExamAnswersStageSettings.from_plain(plain)


def save_without(folder: Path, answered: HeartAnswer) -> None:
    """Save the answer to one heart on speeds alone."""
    origin = Origin(20260, "", "code")
    save(folder / "a.h5", to_dataset([answered]), origin.provenance(KIND, pressures_settings(1)))


def sit_with_pressures(folder: Path, hearts: int, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(exam_pressures, "check_network", lambda *_: None)
    path = folder / "with" / "a.h5"
    absent = {name: folder / name for name in ("estimator", "noise", "null")}
    exam_pressures.exam_pressures(
        **absent,
        without=folder / "a.h5",
        answers=path,
        settings=pressures_settings(hearts),
        origin=Origin(20260, "", "code"),
    )
    return path


def test_pressures_need_the_answers_on_speeds_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    again = "python -m swesbi exam --stream development --generators a --noise cohort"
    with pytest.raises(FileNotFoundError, match=f"a.h5 does not exist; verdicts .* come first: `{again}`"):
        sit_with_pressures(tmp_path, 2, monkeypatch)
    save_without(tmp_path, answer())
    with pytest.raises(FileNotFoundError, match="holds 1 of 2 hearts, number 1 is missing"):
        sit_with_pressures(tmp_path, 2, monkeypatch)
    assert not (tmp_path / "with").exists()


def test_pressures_need_the_answer_of_the_same_heart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_without(tmp_path, answer())
    with pytest.raises(ValueError, match="development-a001: its answer on the speeds alone is of another"):
        sit_with_pressures(tmp_path, 1, monkeypatch)


def test_a_heart_that_was_refused_stays_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    origin = Origin(20260, "", "code")
    examiner = exam.Examiner(tmp_path, tmp_path, tmp_path, pressures_settings(1), origin)
    save_without(tmp_path, refusal(0, examiner.recorded(0).heart, 0, "ivsd_cm = 2 is outside"))
    (found,) = read_answers(sit_with_pressures(tmp_path, 1, monkeypatch))
    assert (found.status, found.reason) == ("refused", "ivsd_cm = 2 is outside")
    assert np.isnan(found.median).all()


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


@pytest.mark.slow(minutes=1)
def test_a_stopped_run_gives_what_one_run_gives_and_what_a_subject_outside_the_study_is_told(
    finished: StudyCopy, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished.folder)
    loaded = load_study(read_merged(finished.folder / "config.yaml", finished.folder / finished.config))
    origin = Origin(loaded.config.seed, "", "code")
    caplog.set_level(logging.INFO, logger="swesbi")
    stopped, whole = tmp_path / "stopped" / "a.h5", tmp_path / "whole" / "a.h5"

    def sit(answers: Path, hearts: int, origin: Origin, processes: int = 1) -> None:
        inputs = vars(finished_population(finished.results, "amortised"))
        settings = made_settings(loaded, hearts)
        exam.exam_answers(**inputs, answers=answers, settings=settings, origin=origin, processes=processes)

    sit(whole, 2, origin, processes=2)
    assert "heart 2/2" in caplog.text
    sit(stopped, 1, origin)
    caplog.clear()
    sit(stopped, 2, origin)
    assert "heart 1/1" in caplog.text
    assert stopped.read_bytes() == whole.read_bytes()
    settings = made_settings(loaded, 1)
    check_answer(read_answers(whole)[0], settings.recorded(0, origin.seed), finished.config, tmp_path)
    files = {name: tmp_path / f"{name}.csv" for name in ("table", "samplers")}
    files |= {f"figure_{kind}": tmp_path / f"exam.{kind}" for kind in ("pdf", "png")}
    shown = exam_table.ExamTableStageSettings.from_plain(stage_settings(loaded, "exam_table"))
    exam_table.exam_table(answers=[whole], **files, settings=shown, origin=origin)
    assert pd.read_csv(files["table"])["generator"].unique().tolist() == [f"a: {settings.source.title}"]
    assert files["figure_png"].read_bytes().startswith(b"\x89PNG")
    monkeypatch.setattr(exam, "_answered", lambda *_: [answer(width_fixed=7.0)])
    sit(stopped, 1, replace(origin, code_hash="other code"))
    assert "is made anew" in caplog.text
    (anew,) = read_answers(stopped)
    assert (anew.width_log_scale_fixed == 7.0).all()


def made_settings(study: Study, hearts: int) -> exam.ExamAnswersStageSettings:
    plain = stage_settings(study, "exam_answers", generator="a", stream=STREAM) | {"hearts": hearts}
    return exam.ExamAnswersStageSettings.from_plain(plain)


def check_answer(found: HeartAnswer, made: RecordedHeart, overlay: str, folder: Path) -> None:
    """A heart, as a subject of a cohort, has the same answer from `new-subject`."""
    subject, cohort, out = made.heart.context.subject, folder / "cohort", folder / "out"
    (cohort / "swe").mkdir(parents=True)
    whole = {"trigger_delay_ms": np.int64, "rr_ms": np.int64}
    samples_table(made.samples).astype(whole).to_csv(cohort / "swe" / f"{subject}.csv", index=False)
    pd.DataFrame([asdict(made.heart.context)]).to_csv(cohort / "subjects.csv", index=False)
    (cohort / "recording.yaml").write_text(
        "origin: a heart of development\nprotocol: { repeats_are: sweeps }\n", encoding="utf-8"
    )
    given = ("--overlay", overlay, "--experiment", "amortised", "--cohort", str(cohort))
    assert main(["new-subject", *given, "--subject", subject, "--out", str(out)]) == 0
    exact = read_exact_result(out / "posterior.h5")
    assert found.status == status(read_support(out / "support.json"))
    assert found.efficiency == exact.efficiency
    low, high = np.quantile(exact.phi[:, 0], interval_levels(0.9))
    assert (found.low[2], found.high[2]) == (low, high)

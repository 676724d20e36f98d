"""Asking other hearts: which of them, what is refused, that answers are those of `infer`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
import pandas as pd
import pytest
from study_copy import ROOT, StudyCopy
from validation_case import HEART, VALIDATION, answer, recorded

from data.makers.files import samples_table
from studies.validation.answers import HeartAnswers, HeartAnswersSettings, Questioner, asked_of
from studies.validation.hearts import ranges
from studies.validation.hearts.recording import DEVELOPMENT, VALIDATION_STREAM, RecordedHeart
from studies.validation.score import HeartAnswer, refusal
from studies.validation.settings import ValidationSettings, answers_settings, table_settings
from studies.validation.stages import FlowOfPopulation, validation, validation_answers
from swesbi.__main__ import main
from swesbi.answers.answer import Knowledge
from swesbi.artefacts import Provenance, UnfitError
from swesbi.config.read import ConfigError, parse_section, read_merged, read_yaml
from swesbi.config.study import Study, load_study
from swesbi.config.view import View
from swesbi.draws import interval_levels
from swesbi.networks.flow.trained import SHIPPED_NETWORK, TrainedFlow
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.noise.cohort import folder_noise
from swesbi.recording.noise.sweeps import SweepLevels
from swesbi.recording.quality import rejection
from swesbi.recording.samples import ACCEPTED
from swesbi.recording.speed import NoiseComponents
from swesbi.report.tables.validation import POOLED_ALL, QUANTITIES
from swesbi.study.job import run_stage
from swesbi.study.results import OF_POPULATION, population_files
from swesbi.study.stage import plain_settings
from swesbi.verdict.verdict import Verdict
from swesbi.virtual.generated import PHYSIOLOGY

FOLDER = Path(__file__).parents[1]
STREAM = "development"
OF_JOB: Final = {"seed": 5, "subject": "", "code": "0"}


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> Study:
    """The shipped study."""
    monkeypatch.chdir(ROOT)
    return load_study(read_merged(ROOT / "config.yaml", None))


def settings_of(**changes: object) -> ValidationSettings:
    return parse_section(VALIDATION.to_plain() | changes, "validation", ValidationSettings)


def test_a_heart_has_the_settings_of_the_answers_of_its_experiment(study: Study) -> None:
    numbers = VALIDATION.numbers(VALIDATION.hearts["b"], 39)
    parts = answers_settings(study, VALIDATION.experiment, "b", VALIDATION.stream, numbers)
    view = View(study, {"experiment": "amortised", "subject": "A"})
    assert parts["train_population"] == plain_settings(OF_POPULATION, view)
    answered = plain_settings("swesbi.answers.answer:answer_of_population", view)
    del answered["cuff"]  # the pressures of a heart are not told
    assert parts | answered == parts
    assert (parts["generator"], parts["stream"], parts["first"], parts["hearts"]) == ("b", "exam", 195, 5)
    assert list(HeartAnswersSettings.from_plain(parts).numbers) == list(range(195, 200))


@pytest.mark.parametrize("hearts_per_job", [1, 7, 10, 300])
def test_jobs_answer_every_heart_once(hearts_per_job: int) -> None:
    asked = settings_of(hearts_per_job=hearts_per_job)
    numbers = [number for part in asked.parts("b") for number in asked.numbers(200, part)]
    assert numbers == list(range(200))


def test_what_cannot_be_asked_is_named(study: Study) -> None:
    with pytest.raises(ConfigError, match="'p' is of development, in no validation"):
        settings_of(generators=["a", "p"], hearts={"a": 1, "p": 1})
    with pytest.raises(ConfigError, match=r"hearts.p: is not said"):
        settings_of(generators=["a", "p"], stream=STREAM)
    with pytest.raises(ConfigError, match="validation.experiment = 'paper' is no experiment over a popul"):
        answers_settings(study, "paper", "a", STREAM, range(1))
    assert not {*DEVELOPMENT} & {*VALIDATION.generators}
    assert VALIDATION.stream == VALIDATION_STREAM


@pytest.mark.parametrize("name", ["small", "development"])
def test_other_sizes_are_of_other_streams(name: str) -> None:
    changes = read_yaml(FOLDER / f"{name}.yaml")["validation"]
    asked = settings_of(**changes | {"hearts": VALIDATION.to_plain()["hearts"] | changes["hearts"]})
    assert asked.stream != VALIDATION.stream


def stored(study: Study, made: Sequence[HeartAnswer], letter: str, path: Path) -> HeartAnswers:
    """Write answers to hearts of a generator as their stage does."""
    numbers = range(made[0].number, made[-1].number + 1)
    plain = answers_settings(study, "amortised", letter, STREAM, numbers)
    answers = HeartAnswers(tuple(made), HeartAnswersSettings.from_plain(plain))
    answers.write(path, Provenance("", settings={"asked": plain}))
    return answers


def test_answers_are_stored_whole(study: Study, tmp_path: Path) -> None:
    made = [answer(0), answer(1, "doubtful", by_mcmc=True), refusal(2, HEART, 3, "ivsd_cm = 2 is outside")]
    written = stored(study, made, "a", tmp_path / "a.h5")
    found = HeartAnswers.read(tmp_path / "a.h5")
    assert found.asked == written.asked
    for one, other in zip(found.of, made, strict=True):
        assert one.context == other.context
        np.testing.assert_equal(asdict(one), asdict(other))


def test_answers_of_several_jobs_are_one_table(study: Study, tmp_path: Path) -> None:
    paths = []
    for first, letter in ((10, "a"), (0, "a"), (0, "b")):
        paths.append(tmp_path / f"{letter}-{first}.h5")
        stored(study, [answer(number) for number in range(first, first + 10)], letter, paths[-1])
    files = {name: [tmp_path / f"{name}.csv"] for name in ("table", "samplers")}
    files |= {f"figure_{kind}": [tmp_path / f"validation.{kind}"] for kind in ("pdf", "png")}
    run_stage(validation, {"answers": paths}, files, table_settings(study, VALIDATION) | OF_JOB)
    table = pd.read_csv(files["table"][0]).drop_duplicates("generator").set_index("generator")["n"]
    assert table.tolist() == [20, 10, 30] and table.index[-1] == POOLED_ALL
    assert files["figure_png"][0].read_bytes().startswith(b"\x89PNG")


def test_a_network_of_other_settings_does_not_answer(study: Study, tmp_path: Path) -> None:
    settings = asked_of(study, "a", 1, STREAM)
    other = dict(settings.train_population) | {"seed_of_others": 1}
    made = Provenance("", settings=other)
    TrainedFlow.read(SHIPPED_NETWORK).write(tmp_path / "flow.h5", made)
    network, nothing = FlowOfPopulation.read(tmp_path / "flow.h5"), cast(Any, None)
    with pytest.raises(UnfitError, match="trained with seed_of_others = 1, the configuration has None"):
        validation_answers(network, nothing, nothing, asked=settings, seed=1)


def test_a_heart_outside_the_declared_range_is_refused(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    made = recorded("a")
    thick = replace(made.heart, context=replace(made.heart.context, ivsd_cm=4.0))
    monkeypatch.setattr(HeartAnswersSettings, "recorded", lambda *_: replace(made, heart=thick))
    settings = asked_of(study, "a", 1, STREAM)
    found = Questioner(Knowledge(cast(Any, None)), NoiseComponents(0.03, 0.06), settings, 1).answer(0)
    assert found.status == "refused" and "ivsd_cm" in found.reason
    assert np.isnan(found.median).all()


def test_the_page_prints_the_ranges_that_hearts_are_drawn_from() -> None:
    lines = (FOLDER / "generators.md").read_text(encoding="utf-8").splitlines()
    cells = [line.split("|")[2:4] for line in lines if line.startswith("| ")]
    printed = [pair for pair in cells if all(" to " in text for text in pair)]  # other tables give counts
    units = (1.0, 1.0, 1.0, 1.0, 1.0, 1e8, 1e-8, 1e-3, 1e-3)
    for (own, doubled), name, unit in zip(printed, PHYSIOLOGY, units, strict=True):
        for text, limits in ((own, PHYSIOLOGY[name]), (doubled, ranges.DOUBLED[name])):
            said = [unit * float(number) for number in text.split(" to ")]
            assert said == pytest.approx(limits, rel=6e-3), name


@pytest.mark.slow(minutes=1)
def test_a_heart_is_told_what_a_subject_outside_the_study_is_told(
    finished: StudyCopy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished.folder)
    loaded = load_study(read_merged(finished.folder / "config.yaml", finished.folder / finished.config))
    seed, settings = loaded.config.seed, asked_of(loaded, "a", 1, STREAM)
    made = settings.recorded(0, seed)
    accepted = rejection(made.samples, settings.recording) == ACCEPTED
    # `infer` knows the noise of a folder of one from this recording and what is expected
    noise = folder_noise([SweepLevels.of(made.samples, accepted)], loaded.config.new_subjects.noise_prior)
    knowledge = population_files(finished.results, "amortised").knowledge()
    found = Questioner(knowledge, noise.components, settings, seed).answer(0)
    check_answer(found, made, finished.config, tmp_path)


def check_answer(found: HeartAnswer, made: RecordedHeart, overlay: str, folder: Path) -> None:
    """A heart, as a subject of a cohort, has the same answer from `infer`."""
    subject, cohort, out = made.heart.context.subject, folder / "cohort", folder / "out"
    (cohort / "swe").mkdir(parents=True)
    whole = {"trigger_delay_ms": np.int64, "rr_ms": np.int64}
    samples_table(made.samples).astype(whole).to_csv(cohort / "swe" / f"{subject}.csv", index=False)
    pd.DataFrame([asdict(made.heart.context)]).to_csv(cohort / "subjects.csv", index=False)
    (cohort / "recording.yaml").write_text(
        "origin: a heart of development\nprotocol: { repeats_are: sweeps }\n", encoding="utf-8"
    )
    given = (str(cohort), "--overlay", overlay, "--experiment", "amortised")
    assert main(["infer", *given, "--subject", subject, "--out", str(out)]) == 0
    exact = ExactPosterior.read(out / subject / "posterior.h5")
    assert found.status == Verdict.read(out / subject / "verdict.json").status
    assert found.efficiency == exact.efficiency
    low, high = np.quantile(exact.phi[:, 0], interval_levels(0.9))
    column = QUANTITIES.index("k0_kpa")
    assert (found.low[column], found.high[column]) == (low, high)

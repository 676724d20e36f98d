"""The exam with cuff pressures: the same hearts, inferred from speeds and pressures together."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swesbi.exam.recorded import RecordedHeart
from swesbi.exam.score import HeartAnswer, read_answers, refusal, truths
from swesbi.measurement.clinical import ClinicalModel, with_pressures
from swesbi.measurement.likelihood import speed_model
from swesbi.measurement.speeds import measured_speeds
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.result import read_exact_result
from swesbi.study.stages.exam import ExamAnswersStageSettings, Examiner, answer_missing, scored
from swesbi.study.stages.new_subject import STREAM
from swesbi.study.stages.origin import Origin
from swesbi.study.stages.other_network import check_network
from swesbi.study.stages.pressures import PressuresStageSettings, infer_with_pressures
from swesbi.verdict.answers import REFUSED


@dataclass(frozen=True)
class InformedExaminer(Examiner):
    """Asks about hearts whose pressures are known too.

    Attributes:
        without: Their answers on the speeds alone, by number; verdicts are those.
    """

    without: Mapping[int, HeartAnswer]

    def answer(self, number: int) -> HeartAnswer:
        """Draw and record the heart of this number, and infer it from speeds and pressures.

        Raises:
            RuntimeError: It could not be recorded.
            ArtefactError: An input is no such artefact.
            ValueError: Its answer on the speeds alone is of another heart.
        """
        made, without = self.recorded(number), self.without[number]
        if not np.array_equal(truths(made.heart), without.truth, equal_nan=True):
            raise ValueError(
                f"heart {made.heart.context.subject}: its answer on the speeds alone is of another heart, "
                "made under other settings or by other code; sit the exam without `--pressures` again"
            )
        if without.status == REFUSED:
            return without
        try:
            return self._informed(number, made, without)
        except NoLikelihoodError as error:
            return refusal(number, made.heart, made.redrawn, str(error))

    def _informed(self, number: int, made: RecordedHeart, without: HeartAnswer) -> HeartAnswer:
        with tempfile.TemporaryDirectory(prefix="swesbi-exam-") as folder:
            posterior = Path(folder) / "with_pressures.h5"
            model = self._inferred(made, posterior)
            exact = read_exact_result(posterior)
        return scored(made, model, exact, number, without.status, without.reason)

    def _inferred(self, made: RecordedHeart, posterior: Path) -> ClinicalModel:
        """Infer a recording as that of any subject outside the study, under the same streams."""
        exact_posterior, clinical = self.settings.exact_posterior, self.settings.clinical
        recording = measured_speeds(made.observation, self.components())
        speeds = speed_model(recording, exact_posterior.model)
        model = with_pressures(speeds, made.observation.clinical, clinical)
        network = self._knowledge().proposal(recording)
        settings = PressuresStageSettings(exact_posterior=exact_posterior, clinical=clinical)
        infer_with_pressures(model, network, posterior, settings, self.origin_of(recording.subject), STREAM)
        return model


def exam_pressures(
    *,
    estimator: Path,
    noise: Path,
    null: Path,
    without: Path,
    answers: Path,
    settings: ExamAnswersStageSettings,
    origin: Origin,
    processes: int = 1,
) -> None:
    """Answer the hearts of one generator from speeds and cuff pressures; verdicts are of the speeds alone.

    Args:
        estimator: The network of the population.
        noise: Noise of the study's cohort, from which standard errors are told.
        null: Null recordings of the population.
        without: Answers to the same hearts on the speeds alone.
        answers: Output, written whole after every few hearts.
        processes: Hearts that are answered side by side; no answer depends on it.

    Raises:
        OtherNetworkError: The network was trained under other settings.
        FileNotFoundError: The hearts have not been answered on the speeds alone, or not all of them.
        RuntimeError: A heart could not be recorded.
        ArtefactError: An input is no such artefact.
        ValueError: No generator has this letter, or an answer on the speeds alone is of another heart.
    """
    check_network(estimator, settings.train_population)
    known = _without_pressures(without, settings)
    examiner = InformedExaminer(estimator, noise, null, settings, origin, known)
    answer_missing(answers, examiner, processes, " with pressures")


def _without_pressures(path: Path, settings: ExamAnswersStageSettings) -> dict[int, HeartAnswer]:
    """Return the answers on the speeds alone, by number.

    Raises:
        FileNotFoundError: They are not there, or not all of them.
        ArtefactError: The file holds no answers.
    """
    first = (
        "verdicts are those of the speeds alone, which come first: `python -m swesbi exam --stream "
        f"{settings.stream} --generators {settings.generator} --noise {settings.noise}`"
    )
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist; {first}")
    known = {answer.number: answer for answer in read_answers(path)}
    if missing := [number for number in range(settings.hearts) if number not in known]:
        raise FileNotFoundError(
            f"{path}: holds {len(known)} of {settings.hearts} hearts, number {missing[0]} is missing; {first}"
        )
    return known

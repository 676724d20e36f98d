"""The answers to the subjects of a cohort, one row a subject, and verdicts in a few words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Final

import numpy as np
import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.csv import Table
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.parameters import REPORTED_NAMES
from swesbi.verdict.verdict import STATUSES, Verdict, VerdictTest

RECORDINGS: Final = {
    "model_noise": "the model's own noise",
    "sample_by_sample": "recorded sample by sample",
    "local": "at the subject's own data",
    "volunteer": "the volunteer recorded anew",
}
ANSWERS: Final = {"proposal": "network alone", "weighted": "exact weights"}
POOLED: Final = "pooled"
"""In place of a subject: the recordings of all."""
SHOWN_TESTS: Final = 3
TEST_LABELS: Final = {
    "boundary_mass": "mass at a bound",
    "context_leave_one_out": "context of the others",
    "context_ranges": "context range",
}
REFUSED: Final = "refused"
OUTCOMES: Final = (*STATUSES, REFUSED)
LIMITS: Final = ("median", "low", "high")
SEPARATOR: Final = "; "


def is_exact(verdict: Verdict) -> bool:
    """Return whether the posterior is that of an exact likelihood, of an experiment on speeds."""
    return verdict.sampler is not None


def verdict_numbers(verdict: Verdict, shown: int = SHOWN_TESTS) -> tuple[str, ...]:
    """Return what decided, in short lines: ``shown`` flagged tests, or the two criteria of prior support."""
    if not is_exact(verdict):
        return support_numbers(verdict)
    # by how strongly they speak, those without a p-value first
    flagged = sorted(
        (test for test in verdict.tests if test.flagged),
        key=lambda test: -1.0 if test.p_value is None else test.p_value,
    )
    lines = tuple(map(_short, flagged))
    more = len(lines) - shown
    return lines if more < 2 else (*lines[:shown], f"and {more} more")


def support_numbers(verdict: Verdict) -> tuple[str, str]:
    """Return the two numbers that decide on prior support: draws within the bounds, largest |z|."""
    plural = "draw" if verdict.in_prior_draws == 1 else "draws"
    return f"{verdict.in_prior_draws:,} in-prior {plural}", f"max |z| = {verdict.max_abs_z:.2f}"


def weights_in_words(verdict: Verdict) -> str:
    """Return how the importance weights did: "k-hat 0.35, efficiency 81 %"."""
    shape = "inf" if verdict.k_hat is None else f"{verdict.k_hat:.2f}"
    share = "" if verdict.efficiency is None else f", efficiency {100.0 * verdict.efficiency:.0f} %"
    return f"k-hat {shape}{share}"


def sampler_in_words(verdict: Verdict) -> str:
    """Return what gave the exact draws: "importance weights" or "MCMC"."""
    return "MCMC" if verdict.sampler == "mcmc" else "importance weights"


def label_of_test(name: str) -> str:
    """Return a test's name in words: "time_to_peak" as "time to peak"."""
    return TEST_LABELS.get(name, name.replace("_", " "))


def _short(test: VerdictTest) -> str:
    if test.p_value is None:
        return label_of_test(test.name)
    small = test.p_value < 0.001
    return f"{label_of_test(test.name)}, p {'< 0.001' if small else f'= {test.p_value:.3f}'}"


@dataclass(frozen=True)
class AnswerSummary:
    """The answer to one recording: verdict, limits, how reliable its draws are.

    ``reason`` names the tests that contradict the model; limits (q, 3) are median, lower and upper of each
    reported quantity.
    """

    status: str
    reason: str
    limits: FloatArray
    interval_mass: float
    k_hat: float
    efficiency: float
    sampler: str

    @property
    def row(self) -> dict[str, object]:
        """Verdict and answer by column."""
        values = [*self.limits.ravel().tolist(), self.k_hat, self.efficiency, self.sampler]
        said: dict[str, object] = {"status": self.status, "reason": self.reason}
        return said | dict(zip(answer_columns(), values, strict=True))


def answer_summary(judged: Verdict) -> AnswerSummary:
    """Return what is reported of a subject by a verdict of an experiment on speeds."""
    told = [judged.answer[name] for name in REPORTED_NAMES]
    return AnswerSummary(
        status=judged.status,
        reason=SEPARATOR.join(label_of_test(test.name) for test in judged.tests if test.flagged),
        limits=np.array([[float(each[limit]) for limit in LIMITS] for each in told]),
        interval_mass=float(told[0]["interval_mass"]),
        k_hat=np.nan if judged.k_hat is None else judged.k_hat,
        efficiency=np.nan if judged.efficiency is None else judged.efficiency,
        sampler=judged.sampler or "",
    )


def cohort_table(
    contexts: Sequence[Context], answers: Mapping[str, AnswerSummary], refused: Mapping[str, str]
) -> pd.DataFrame:
    """Return context, verdict and answer of every subject; a refused one has its reason and no answer.

    Raises ArtefactError where a subject has neither.
    """
    return pd.DataFrame(
        [asdict(context) | _outcome(context.subject, answers, refused) for context in contexts]
    )


def _outcome(
    subject: str, answers: Mapping[str, AnswerSummary], refused: Mapping[str, str]
) -> dict[str, object]:
    if subject in refused:
        return {"status": REFUSED, "reason": refused[subject]} | dict.fromkeys(answer_columns(), np.nan)
    if subject not in answers:
        raise ArtefactError(f"subject {subject}: neither a posterior nor a reason for refusal is given")
    return answers[subject].row


def answer_columns() -> tuple[str, ...]:
    """Return the columns of an answer: limits of each quantity, then how the draws were obtained."""
    limits = [f"{name}_{limit}" for name in REPORTED_NAMES for limit in LIMITS]
    return (*limits, "k_hat", "efficiency", "sampler")


COHORT: Final = Table(columns=("subject", "status", "reason", *answer_columns()), texts=("reason",))
CohortTable = Annotated[pd.DataFrame, COHORT]
"""``cohort.csv``."""

"""What a network over a population says of every subject of a cohort, one row a subject."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError, load
from swesbi.context import Context
from swesbi.evaluation.verdict import STATUSES, label_of_test, status
from swesbi.inference.dataset import POSTERIOR
from swesbi.inference.support import read_support
from swesbi.parameters import PHI_NAMES

FloatArray = NDArray[np.float64]
REFUSED: Final = "refused"
OUTCOMES: Final = (*STATUSES, REFUSED)
LIMITS: Final = ("median", "low", "high")
SEPARATOR: Final = "; "


@dataclass(frozen=True)
class Answer:
    """The answer to one recording.

    Attributes:
        status: The verdict.
        reason: The tests that speak against the model, in words; empty where none does.
        phi: Median, lower and upper limit of the credible interval of the four parameters; shape (3, 4).
        k_hat: Pareto shape of the importance weights.
        efficiency: Their effective share.
        sampler: What gave the draws: importance or mcmc.
    """

    status: str
    reason: str
    phi: FloatArray
    k_hat: float
    efficiency: float
    sampler: str


def read_answer(posterior: Path, support: Path) -> Answer:
    """Read the summary of a posterior, and not its draws, with the verdict on it.

    Raises:
        ArtefactError: A file is not what its name says.
    """
    root, judged = load(posterior, POSTERIOR)[0], read_support(support)
    if "passive_scale_median_kpa" not in root:
        raise ArtefactError(f"{posterior}: is not the posterior of an experiment on speeds")
    theta = np.vstack([root["median"].to_numpy(), root["interval"].transpose("bound", "parameter")])
    scale = np.append(root["passive_scale_median_kpa"], root["passive_scale_interval_kpa"])
    return Answer(
        status=status(judged),
        reason=SEPARATOR.join(label_of_test(test.name) for test in judged.tests if test.flagged),
        phi=np.column_stack([theta, scale]),
        k_hat=float(root["k_hat"]),
        efficiency=float(root["efficiency"]),
        sampler=str(root["sampler"].item()),
    )


def cohort_table(
    contexts: Sequence[Context], answers: Mapping[str, Answer], refused: Mapping[str, str]
) -> pd.DataFrame:
    """Return context, verdict and answer of every subject; a refused one has its reason and no answer.

    Args:
        contexts: All subjects.
        answers: By subject.
        refused: Reasons, by subject.

    Raises:
        ArtefactError: A subject has neither an answer nor a reason.
    """
    return pd.DataFrame([asdict(one) | _outcome(one.subject, answers, refused) for one in contexts])


def _outcome(subject: str, answers: Mapping[str, Answer], refused: Mapping[str, str]) -> dict[str, object]:
    if subject in refused:
        return {"status": REFUSED, "reason": refused[subject]} | dict.fromkeys(answer_columns(), np.nan)
    if subject not in answers:
        raise ArtefactError(f"subject {subject}: neither a posterior nor a reason for refusal is given")
    answer = answers[subject]
    values = [*answer.phi.T.ravel().tolist(), answer.k_hat, answer.efficiency, answer.sampler]
    outcome: dict[str, object] = {"status": answer.status, "reason": answer.reason}
    return outcome | dict(zip(answer_columns(), values, strict=True))


def answer_columns() -> tuple[str, ...]:
    """Return the columns of an answer: limits of each parameter, then how the draws were come by."""
    limits = [f"{name}_{limit}" for name in PHI_NAMES for limit in LIMITS]
    return (*limits, "k_hat", "efficiency", "sampler")


def read_cohort(path: Path) -> pd.DataFrame:
    """Read ``cohort.csv``.

    Raises:
        ArtefactError: A column is missing.
    """
    table = pd.read_csv(path, converters={"subject": str})
    if missing := [name for name in ("subject", "status", "reason", *answer_columns()) if name not in table]:
        raise ArtefactError(f"{path}: lacks the columns {', '.join(missing)}; delete it and rerun")
    return table.assign(reason=table["reason"].astype(object).fillna(""))

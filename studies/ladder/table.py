"""The table of the ladder: posteriors, evidence, model probabilities, the average over structures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.special import softmax

from studies.ladder.posteriors import (
    CHANGED,
    CHOSEN,
    SHIPPED,
    LadderPosterior,
    StructureResult,
    check_same_subjects,
)
from studies.ladder.quantities import CHANGE_OF, QUANTITIES, WORDS
from studies.ladder.quantities import CHANGED as WITHIN_A_PERSON
from swesbi.base.arrays import FloatArray
from swesbi.checks.settings import BASE
from swesbi.draws import median_and_interval, resampled_rows
from swesbi.seeds import generator

COLUMNS: Final = (
    "answer", "structure", "label", "subject", "quantity", "words", "median", "ci_low", "ci_high",
    "shift_in_widths", "width_ratio", "log_evidence", "log_evidence_se", "probability", "probability_se",
    "speed_fraction", "timing_cycle", "sampler", "k_hat", "efficiency", "converged",
)  # fmt: skip
AVERAGE: Final = "average"
AVERAGE_LABEL: Final = "average over structures"
ABOUT_PEOPLE: Final = (
    "The volunteers are made with a destruction alpha of 1.3 to 1.8 and the timing of the shipped setting: "
    "their evidence for or against a structure says nothing of people."
)
"""What stands at every table and figure of the ladder's evidence on the virtual volunteers."""


@dataclass(frozen=True)
class Probabilities:
    """Posterior probabilities of S structures that are equally probable beforehand, with standard errors."""

    probability: FloatArray
    se: FloatArray


def model_probabilities(log_evidence: FloatArray, se: FloatArray) -> Probabilities:
    """Return p_i = exp(L_i) / sum exp(L_j), and its Monte Carlo error.

    From dp_i = p_i (dL_i - sum_j p_j dL_j), with errors of the L that are independent,
    Var p_i = p_i^2 [(1 - p_i)^2 s_i^2 + sum_{j != i} p_j^2 s_j^2].

    Args:
        log_evidence: L; shape (S,).
        se: Standard errors s; shape (S,).
    """
    p = softmax(log_evidence)
    others = (p * se) ** 2
    variance = p**2 * ((1.0 - p) ** 2 * se**2 + others.sum() - others)
    return Probabilities(np.asarray(p), np.asarray(np.sqrt(variance)))


def averaged(values: Sequence[FloatArray], probability: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return draws of the mixture of S posteriors, sum p_i p(. | data, structure i) (Hoeting et al. 1999).

    Args:
        values: Draws (n_i, q) under each structure.
        probability: p; shape (S,).
        rng: Source of the resampling; as many draws come back as the first structure has.
    """
    counts = [len(part) for part in values]
    weight = np.repeat(probability / counts, counts)
    return np.asarray(np.concatenate(values)[resampled_rows(weight, counts[0], rng)])


@dataclass(frozen=True)
class _Answer:
    """One subject's draws of named quantities, and what its rows say beside them."""

    names: tuple[str, ...]
    draws: FloatArray
    said: Mapping[str, Any]


def ladder_table(
    results: Mapping[str, StructureResult], labels: Mapping[str, str], mass: float, seed: int
) -> pd.DataFrame:
    """Return one row an answer, structure, subject and quantity, the average over structures last.

    ``answer`` is ``shipped`` (delta and tau as configured) or ``evidence`` (the pair of largest total log
    evidence under the structure). ``shift_in_widths`` is the move of the median from the base's, in widths
    of the base's interval; probabilities are of the structures for one subject's recording.

    Args:
        results: By structure; the base is called ``base``.
        labels: What each structure is called, in the order shown.
        mass: Mass of the equal-tailed intervals.
        seed: The study's seed.

    Raises:
        ValueError: Structures have other subjects.
    """
    check_same_subjects(list(results.values()))
    subjects = list(results[BASE].answers(SHIPPED))
    rows = [
        row
        for answer in (SHIPPED, CHOSEN)
        for subject in subjects
        for row in _rows_of_subject(results, labels, answer, subject, mass, seed)
    ]
    order = {name: number for number, name in enumerate((*labels, AVERAGE))}
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    by_structure = [table["answer"].map({SHIPPED: 0, CHOSEN: 1}), table["structure"].map(order)]
    return table.iloc[np.lexsort((by_structure[1], by_structure[0]))].reset_index(drop=True)


def _rows_of_subject(
    results: Mapping[str, StructureResult],
    labels: Mapping[str, str],
    answer: str,
    subject: str,
    mass: float,
    seed: int,
) -> Iterator[dict[str, Any]]:
    parts = {name: results[name].answers(answer)[subject] for name in labels}
    found = model_probabilities(
        np.array([part.log_evidence for part in parts.values()]),
        np.array([part.log_evidence_se for part in parts.values()]),
    )
    answers = {
        name: _with_changes(part, results[name].answers(CHANGED)[subject] if answer == SHIPPED else None)
        for name, part in parts.items()
    }
    reference = _quantiles(answers[BASE], mass)
    both = zip(found.probability.tolist(), found.se.tolist(), strict=True)
    for (name, one), (probability, error) in zip(answers.items(), both, strict=True):
        said = {"structure": name, "label": labels[name], "probability": probability, "probability_se": error}
        yield from _rows(one, said | {"answer": answer, "subject": subject}, reference, mass)
    rng = generator(seed, "ladder", "average", answer, subject)
    mixture = averaged([one.draws for one in answers.values()], found.probability, rng)
    evidences = [part.log_evidence for part in parts.values()]
    said = {
        "structure": AVERAGE, "label": AVERAGE_LABEL, "answer": answer, "subject": subject,
        "log_evidence": float(np.logaddexp.reduce(evidences) - np.log(len(evidences))),
    }  # fmt: skip
    yield from _rows(_Answer(answers[BASE].names, mixture, said), {}, reference, mass)


def _with_changes(first: LadderPosterior, second: LadderPosterior | None) -> _Answer:
    """Return the quantities of a recording; beside them, their ratios where there is a second recording.

    The two posteriors' draws are paired as they come, as if their errors had nothing in common: intervals of
    a ratio are so too wide, and its median stays.
    """
    names = tuple(quantity.name for quantity in QUANTITIES)
    said = {
        name: getattr(first, name)
        for name in ("log_evidence", "log_evidence_se", "speed_fraction", "timing_cycle", "sampler", "k_hat")
    } | {"efficiency": first.efficiency, "converged": int(first.converged)}
    if second is None:
        return _Answer(names, first.values, said)
    columns = [names.index(name) for name in WITHIN_A_PERSON]
    ratio = second.values[:, columns] / first.values[:, columns]
    changes = tuple(f"{CHANGE_OF}{name}" for name in WITHIN_A_PERSON)
    return _Answer(names + changes, np.hstack([first.values, ratio]), said)


def _quantiles(answer: _Answer, mass: float) -> FloatArray:
    return np.stack(median_and_interval(answer.draws, mass))


def _rows(
    answer: _Answer, said: Mapping[str, Any], reference: FloatArray, mass: float
) -> Iterator[dict[str, Any]]:
    quantiles = _quantiles(answer, mass)
    width = reference[2] - reference[0]
    for j, name in enumerate(answer.names):
        yield {
            **answer.said,
            **said,
            "quantity": name,
            "words": WORDS[name],
            "median": quantiles[1, j],
            "ci_low": quantiles[0, j],
            "ci_high": quantiles[2, j],
            "shift_in_widths": (quantiles[1, j] - reference[1, j]) / width[j],
            "width_ratio": (quantiles[2, j] - quantiles[0, j]) / width[j],
        }

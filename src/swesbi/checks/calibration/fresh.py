"""Calibration on fresh contexts of a population: over all of them, and by stratum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Final

import numpy as np
import pandas as pd

from swesbi.artefacts import Part, Variable
from swesbi.base.arrays import BoolArray, FloatArray, below_each_other, rows_of
from swesbi.base.progress import Progress
from swesbi.checks.calibration import ranks
from swesbi.checks.calibration.recordings import infer_recordings
from swesbi.checks.calibration.settings import JudgementSettings, RecordingsSettings
from swesbi.checks.calibration.table import check_scores
from swesbi.checks.recovery import score_recovery
from swesbi.context import Context
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.recordings import STREAMS, FreshSettings, fresh_subject, record_fresh, recorded
from swesbi.population.settings import StrataSettings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import PriorSettings

STREAM = "population calibration"
ALL: Final = "all"


@dataclass(frozen=True)
class FreshRecordings:
    """Recordings of n fresh contexts, one each, with what was inferred.

    Attributes:
        contexts: The contexts.
        inferred: RankScores and diagnostics.
        refused: Recordings that ingestion refused; they are not among the n.
    """

    contexts: tuple[Context, ...]
    relative_se: Annotated[
        FloatArray,
        Variable(
            "recording", "1", "standard error of the mean speed of a phase without failed samples, over it"
        ),
    ]
    inferred: Annotated[ranks.InferredRecordings, Part()]
    refused: int

    @classmethod
    def joined(cls, parts: Sequence[FreshRecordings]) -> FreshRecordings:
        """Return several, in the order given."""
        contexts = tuple(context for part in parts for context in part.contexts)
        refused = sum(part.refused for part in parts)
        return replace(below_each_other(parts), contexts=contexts, refused=refused)


def infer_fresh(
    index: Sequence[int],
    kind: str,
    flow: TrainedFlow,
    fresh: FreshSettings,
    settings: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
) -> FreshRecordings:
    """Record the numbered fresh contexts once each, and infer every recording by both samplers.

    Args:
        index: Numbers of the contexts; each has random streams of its own.
        kind: ``MODEL_NOISE`` or ``SAMPLE_BY_SAMPLE``.
        flow: The trained network.
        fresh: Where contexts and recordings come from.
        settings: Draws of each posterior.
        exact: The study's own settings of the exact posterior.
        seed: The study's seed.

    Raises:
        ValueError: Ingestion refused every recording.
    """
    progress = Progress(f"calibration on fresh contexts ({kind})", len(index), unit="recording")
    contexts, levels, parts = [], [], []
    for number in index:
        subject = fresh_subject(number, fresh, seed, STREAM)
        made = record_fresh(subject, kind, fresh, seed, STREAM, STREAMS[kind])
        progress.step()
        if not made.recordings:
            continue
        model = recorded(subject, made)
        name = f"population {STREAMS[kind]}"
        parts.append(infer_recordings(model, made, flow, settings, exact, seed, name))
        contexts.append(subject.context)
        levels.append(subject.level)
    if not parts:
        raise ValueError(
            f"all {len(index)} {kind} recordings were refused; check the experiment's conditions"
        )
    return FreshRecordings(
        tuple(contexts), np.array(levels), below_each_other(parts), len(index) - len(parts)
    )


def strata(
    contexts: Sequence[Context], relative_se: FloatArray, settings: StrataSettings
) -> dict[str, BoolArray]:
    """Return which of n recordings lie in each marginal stratum, by its name; shape (n,) each."""
    sex = np.array([context.sex for context in contexts])
    by_stratum = {f"sex {name}": sex == name for name in ("F", "M")}
    columns = {
        name: np.array([getattr(context, name) for context in contexts])
        for name in ("age_years", "hr_bpm", "lvedv_ml", "ivsd_cm")
    }
    for name, values in (columns | {"relative_se": relative_se}).items():
        cuts = getattr(settings, name)
        interval = np.digitize(values, cuts)
        edges = ("", *(f"{cut:g}" for cut in cuts), "")
        for number in range(len(cuts) + 1):
            by_stratum[f"{name} {_between(edges[number], edges[number + 1])}"] = interval == number
    return by_stratum


def _between(low: str, high: str) -> str:
    if not low:
        return f"below {high}"
    return f"{low} to {high}" if high else f"{low} and more"


def by_stratum(
    fresh: FreshRecordings,
    raised: BoolArray,
    prior: PriorSettings,
    judgement: JudgementSettings,
    settings: StrataSettings,
) -> pd.DataFrame:
    """Return coverage by sampler and stratum, with efficiency of the weights and false alarms in each.

    Args:
        fresh: The answers to n recordings.
        raised: On which of them the tests of the verdict raise an alarm; shape (n,).
        prior: Prior of theta, against which contraction is taken.
        judgement: Levels.
        settings: Where continuous values are cut.
    """
    parts = {ALL: np.ones(len(fresh.contexts), dtype=bool)}
    parts |= strata(fresh.contexts, fresh.relative_se, settings)
    rows: list[dict[str, object]] = []
    for sampler in ranks.SAMPLERS:
        for name, chosen in parts.items():
            if not chosen.any():
                continue
            beside = {
                "median_efficiency": float(np.median(fresh.inferred.diagnostics.efficiency[chosen])),
                "false_alarms": float(np.mean(raised[chosen])),
            }
            recovered = rows_of(fresh.inferred.ranked, chosen).recovered(sampler)
            for row in score_recovery(recovered, prior, judgement):
                labels = {"sampler": sampler, "stratum": name}
                rows.append(labels | asdict(row) | beside)
    return pd.DataFrame(rows)


def checks_of(fresh: dict[str, FreshRecordings], judgement: JudgementSettings) -> pd.DataFrame:
    """Return one row a check over all fresh contexts, by kind of recording and sampler."""
    rows: list[dict[str, object]] = []
    for kind, part in fresh.items():
        for sampler in ranks.SAMPLERS:
            ranked = part.inferred.ranked
            checks = check_scores(
                ranked.of(sampler), ranked.prior_variance, ranked.names,
                judgement.alpha, judgement.least_contraction,
            )  # fmt: skip
            labels = {"recordings": kind, "sampler": sampler}
            rows.extend(labels | asdict(check) | {"flagged": int(check.flagged)} for check in checks)
    return pd.DataFrame(rows)

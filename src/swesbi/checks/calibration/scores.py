"""What is made of recordings of known parameters: checks, coverage by group, false alarms."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import PlainTable, WholeTable
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.checks.calibration.dataset import (
    Calibration,
    CalibrationLocal,
    CalibrationRecordings,
    FreshRecordings,
    InferredRecordings,
    PopulationCalibration,
    PushesCalibration,
)
from swesbi.checks.calibration.ranks import WEIGHTED
from swesbi.checks.calibration.table import (
    DOUBTFUL_OR_WORSE,
    LOCAL,
    POOLED,
    CalibrationTable,
    StrataTable,
    alarm_table,
    alarms,
    classifier_rows,
    coverage,
    judge,
    long_table,
)
from swesbi.checks.settings import JudgementSettings
from swesbi.context import Context
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE
from swesbi.population.settings import StrataSettings
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.settings import RuleSettings

LOGGER = logging.getLogger("swesbi")
ALL: Final = "all"
PUSHES: Final = "pushes"


class CohortCalibration(NamedTuple):
    """All recordings of a cohort, a row a check, false alarms, and coverage of the exact posterior.

    ``recovery`` is of recordings under the model's own noise, ``recovery_acquisition`` of acquired ones.
    """

    calibration: Calibration
    table: CalibrationTable
    alarms: WholeTable
    recovery: WholeTable
    recovery_acquisition: WholeTable


def calibration_of_cohort(
    recordings: tuple[CalibrationRecordings, ...],
    local_parts: tuple[CalibrationLocal, ...],
    null: NullRecordings,
    *,
    judgement: JudgementSettings,
    rule: RuleSettings,
) -> CohortCalibration:
    """Join the subjects' recordings of known parameters and judge the calibration of the whole cohort.

    Both recoveries score the posterior that is reported, over all recordings of the cohort, none left out.
    """
    found = Calibration.of(recordings, local_parts)
    of_kind = {MODEL_NOISE: found.model_noise, SAMPLE_BY_SAMPLE: found.sample_by_sample}
    rows, _, tables = _scored(of_kind, null, judgement, rule)
    single = judge(pd.concat([rows, long_table({LOCAL: found.local})]), judgement)
    checks = pd.concat([tables["table"], single]).groupby(["recordings", "sampler"], sort=False)
    compared = classifier_rows(found.two_samples, judgement.max_c2st)
    tables["table"] = pd.concat([*(part for _, part in checks), compared])
    return CohortCalibration(calibration=found, **tables)


def _scored(
    of_kind: Mapping[str, InferredRecordings],
    null: NullRecordings,
    judgement: JudgementSettings,
    rule: RuleSettings,
) -> tuple[pd.DataFrame, dict[str, dict[str, BoolArray]], dict[str, pd.DataFrame]]:
    """Return what gated recordings of a cohort and of a population have in common.

    The long table, by their kind on which of them each alarm is raised, and the tables of results by name.
    """
    rows = long_table({kind: part.ranked for kind, part in of_kind.items()})
    raised = {kind: alarms(part.misfits, null.gated, rule) for kind, part in of_kind.items()}
    exact = rows[rows["sampler"] == WEIGHTED]
    names = {"recovery": MODEL_NOISE, "recovery_acquisition": SAMPLE_BY_SAMPLE}
    checks, rates = judge(rows.assign(subject=POOLED), judgement), alarm_table(raised, judgement.confidence)
    LOGGER.info("%d of %d checks of all recordings flagged", checks["flagged"].sum(), len(checks))
    recoveries = {
        name: coverage(exact[exact["recordings"] == kind], [], judgement) for name, kind in names.items()
    }
    return rows, raised, {"table": checks, "alarms": rates} | recoveries


class PopulationScores(NamedTuple):
    """What :class:`CohortCalibration` has, of fresh contexts, and coverage under model noise by stratum."""

    calibration: PopulationCalibration
    table: CalibrationTable
    strata: StrataTable
    alarms: WholeTable
    recovery: WholeTable
    recovery_acquisition: WholeTable


def scores_on_fresh(
    parts: PopulationCalibration,
    null: NullRecordings,
    *,
    judgement: JudgementSettings,
    strata: StrataSettings,
    rule: RuleSettings,
) -> PopulationScores:
    """Judge calibration on fresh contexts, over all of them and by stratum."""
    own, acquired = parts.model_noise, parts.sample_by_sample
    of_kind = {MODEL_NOISE: own.inferred, SAMPLE_BY_SAMPLE: acquired.inferred}
    _, raised, tables = _scored(of_kind, null, judgement, rule)
    cut = strata_of(own.contexts, own.relative_se, strata)
    by_strata = by_stratum(own, cut, raised[MODEL_NOISE], judgement)
    return PopulationScores(calibration=parts, strata=by_strata, **tables)


class PushesScores(NamedTuple):
    """All free-running recordings, and the coverage of the exact posterior by number of pushes."""

    calibration: PushesCalibration
    table: PlainTable


def scores_on_pushes(
    parts: PushesCalibration, null: NullRecordings, *, judgement: JudgementSettings, rule: RuleSettings
) -> PushesScores:
    """Score free-running recordings of fresh contexts by the number of their pushes."""
    pushes, misfits = parts.pushes, parts.pushes.inferred.misfits
    numbers = {str(number): misfits.points == number for number in sorted(set(misfits.points.tolist()))}
    table = by_stratum(pushes, numbers, alarms(misfits, null.pushes, rule), judgement)
    exact = table[table["sampler"] == WEIGHTED].drop(columns="sampler")
    return PushesScores(parts, exact.rename(columns={"stratum": PUSHES}))


def strata_of(
    contexts: Sequence[Context], relative_se: FloatArray, settings: StrataSettings
) -> dict[str, BoolArray]:
    """Return which of n recordings lie in each marginal stratum, by its name; shape (n,) each."""
    sex = np.array([context.sex for context in contexts])
    by_name = {f"sex {name}": sex == name for name in ("F", "M")}
    for name in StrataSettings.model_fields:
        cuts = getattr(settings, name)
        of_noise = name == "relative_se"
        values = relative_se if of_noise else [getattr(context, name) for context in contexts]
        interval = np.digitize(values, cuts)
        between = [f"{low:g} to {high:g}" for low, high in pairwise(cuts)]
        for number, words in enumerate([f"below {cuts[0]:g}", *between, f"{cuts[-1]:g} and more"]):
            by_name[f"{name} {words}"] = interval == number
    return by_name


def by_stratum(
    fresh: FreshRecordings,
    strata: Mapping[str, BoolArray],
    raised: Mapping[str, BoolArray],
    judgement: JudgementSettings,
) -> pd.DataFrame:
    """Return coverage by stratum and sampler, with what the sampler and the tests of the verdict did in each.

    Strata say which of the n recordings lie in each, all together coming first; ``raised`` says on which of
    them each alarm is raised. Shapes are (n,).
    """
    rows, diagnostics = long_table({MODEL_NOISE: fresh.inferred.ranked}), fresh.inferred.diagnostics
    parts, beside = [], []
    for name, chosen in ({ALL: np.ones(len(fresh.contexts), dtype=bool)} | dict(strata)).items():
        if chosen.any():
            parts.append(rows[chosen[rows["number"]]].assign(stratum=name))
            found = {
                "median_efficiency": np.median(diagnostics.efficiency[chosen]),
                "by_mcmc": diagnostics.by_mcmc[chosen].mean(),
                "false_alarms": raised[DOUBTFUL_OR_WORSE][chosen].mean(),
            }
            beside.append({"stratum": name} | found)
    by_sampler = pd.concat(parts).sort_values("sampler", kind="stable")
    covered = coverage(by_sampler, ["sampler", "stratum"], judgement)
    return covered.merge(pd.DataFrame(beside), on="stratum", how="left")

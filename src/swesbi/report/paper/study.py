"""What the paper prints, beside a study: every number of it, and every statement on its results."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import NamedTuple

from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import ByExperiment, BySubject
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.settings import CmaesSettings, PredictiveSettings, RecoverySettings
from swesbi.networks.paper.pool import Pool
from swesbi.networks.settings import EstimatorSettings, ObservationModelSettings
from swesbi.networks.training_tables import TrainingTable
from swesbi.prior import PriorSettings
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.report.paper.comparison import (
    ComparisonTable,
    StatementsTable,
    comparison_table,
    score_in_words,
    statements_table,
)
from swesbi.report.paper.design import (
    fits_of_study,
    pool_of_study,
    recordings_of_study,
    settings_of_study,
)
from swesbi.report.paper.study_values import Findings
from swesbi.report.paper.values import read_paper
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict

LOGGER = logging.getLogger("swesbi")


class PaperComparison(NamedTuple):
    """One row for every number that the paper prints, and one for every statement on its results."""

    comparison_csv: ComparisonTable
    statements_csv: StatementsTable


def beside_the_paper(
    protocol: Path,
    ppc: PlainTable,
    posterior: PlainTable,
    features: PlainTable,
    recoveries: ByExperiment[PlainTable],
    training: TrainingTable,
    pool: Pool,
    verdicts: BySubject[Verdict],
    observations: tuple[Observation, ...],
    cmaes: BySubject[CmaesFit],
    *,
    cohort_title: str,
    main_experiment: str,
    prior: PriorSettings,
    observation_model: ObservationModelSettings,
    estimator: EstimatorSettings,
    support: SupportSettings,
    predictive: PredictiveSettings,
    recovery: RecoverySettings,
    search: CmaesSettings,
    recording: RecordingSettings,
) -> PaperComparison:
    """Compare the paper with a study.

    ``protocol`` is the cohort's ``recording.yaml``; tables and recoveries are of all experiments, and what
    follows them, settings too, of the main one.

    Raises:
        ArtefactError: ``recording.yaml`` cannot be read.
    """
    of_search, of_recording = search.to_plain(), recording.to_plain()
    experiment = {
        "prior": prior, "observation_model": observation_model, "estimator": estimator, "support": support,
        "predictive": predictive, "recovery": recovery,
    }  # fmt: skip
    plain = {name: each.to_plain() for name, each in experiment.items()}
    settings = {"experiment": plain, "cmaes": of_search, "recording": of_recording}
    study = Findings(
        cohort_title=cohort_title,
        main=main_experiment,
        ppc=ppc,
        posterior=posterior,
        features=features,
        verdicts=dict(verdicts),
        recoveries=dict(recoveries),
        design={
            **settings_of_study(settings, training),
            "protocol": read_recording_file(protocol.parent).protocol.to_plain(),
            "pool": pool_of_study(pool, cohort_title),
            "recordings": recordings_of_study(observations, of_recording["density_kg_m3"]),
            "fits": fits_of_study(dict(cmaes), of_search),
        },
    )
    numbers = read_paper()
    table, statements = comparison_table(numbers, study), statements_table(numbers, study)
    LOGGER.info(score_in_words(statements))
    return PaperComparison(table, statements)

"""Every number of the paper beside this study's, as CSV and LaTeX."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from swesbi.artefacts import ArtefactError, atomic_path
from swesbi.base import Settings
from swesbi.checks.cmaes import read_cmaes
from swesbi.checks.settings import CmaesSettings, PredictiveSettings, RecoverySettings
from swesbi.networks.paper.pool import read_pool
from swesbi.networks.settings import EstimatorSettings, ObservationModelSettings
from swesbi.prior import PriorSettings
from swesbi.recording.observation import read_observation
from swesbi.recording.settings import RecordingSettings
from swesbi.show.csv import write_csv
from swesbi.show.figures.training import read_history
from swesbi.show.latex import comparison_latex
from swesbi.show.paper.comparison import comparison_table
from swesbi.show.paper.measured import StudyResults, pool_size
from swesbi.show.paper.values import read_paper
from swesbi.study.stages.origin import Origin, by_key, by_subject
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.support import read_support


class ComparedExperimentSettings(Settings):
    """The parts of the main experiment whose numbers the paper prints."""

    prior: PriorSettings
    observation_model: ObservationModelSettings
    estimator: EstimatorSettings
    support: SupportSettings
    predictive: PredictiveSettings
    recovery: RecoverySettings


class PaperComparisonSettings(Settings):
    """What is compared beside the results: the main experiment's settings, the search's, the recording's."""

    cohort_title: str
    main_experiment: str
    experiment: ComparedExperimentSettings
    cmaes: CmaesSettings
    recording: RecordingSettings


def paper_comparison(
    *,
    protocol: Path,
    ppc: Path,
    posterior: Path,
    features: Path,
    recoveries: Sequence[Path],
    training: Path,
    pool: Path,
    supports: Sequence[Path],
    observations: Sequence[Path],
    cmaes: Sequence[Path],
    comparison_csv: Path,
    comparison_tex: Path,
    settings: PaperComparisonSettings,
    origin: Origin,
) -> None:
    """Write one row for every number that the paper prints.

    ``protocol`` is the cohort's ``recording.yaml``; ``supports``, ``training`` and ``pool`` are of the main
    experiment, the other tables of all.

    Raises:
        ArtefactError: A file cannot be read.
    """
    numbers = read_paper()
    study = StudyResults(
        cohort_title=settings.cohort_title,
        main=settings.main_experiment,
        settings=settings.to_plain(),
        protocol=_read_protocol(protocol),
        ppc=pd.read_csv(ppc),
        posterior=pd.read_csv(posterior),
        features=pd.read_csv(features),
        supports={key.subject: read_support(path) for key, path in by_key(supports).items()},
        recoveries={path.parent.name: pd.read_csv(path) for path in recoveries},
        training=read_history(training),
        pool=pool_size(read_pool(pool)),
        observations=[read_observation(path) for path in observations],
        fits={subject: read_cmaes(path)[0] for subject, path in by_subject(cmaes).items()},
    )
    table = comparison_table(numbers, study)
    write_csv(comparison_csv, table)
    with atomic_path(comparison_tex) as temporary:
        temporary.write_text(comparison_latex(numbers, table, settings.cohort_title), encoding="utf-8")


def _read_protocol(path: Path) -> dict[str, Any]:
    """Return the numbers of the acquisition protocol; a cohort need not give them.

    Raises:
        ArtefactError: The file is no YAML mapping.
    """
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    protocol = content.get("protocol", {}) if isinstance(content, dict) else None
    if not isinstance(protocol, dict):
        raise ArtefactError(f"{path}: expected a mapping with the key 'protocol', a mapping too")
    return protocol

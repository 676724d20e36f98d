"""Stage: whether a population's network and one trained on the cohort give the same posteriors."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from pydantic import Field

from swesbi.calibration.ranked import NETWORK, WEIGHTED
from swesbi.calibration.two_samples import classifier_accuracy
from swesbi.evaluation.exact_result import read_exact_result
from swesbi.seeds import integer_seed
from swesbi.settings import Settings
from swesbi.show.csv import write_csv
from swesbi.speed_model.joint_prior import JointPriorSettings
from swesbi.stages.origin import Origin
from swesbi.stages.places import by_place, place_of

LOGGER = logging.getLogger("swesbi")


class PopulationAgreementStageSettings(Settings):
    """What the comparison depends on."""

    prior: JointPriorSettings
    draws: int = Field(ge=50, description="draws of each sample that a classifier sees")


def run(
    *,
    posteriors: Sequence[Path],
    base_posteriors: Sequence[Path],
    table: Path,
    settings: PopulationAgreementStageSettings,
    origin: Origin,
) -> None:
    """Let a classifier tell the draws for each subject from the exact ones of the base experiment.

    Args:
        posteriors: Posteriors of the experiment over a population.
        base_posteriors: Posteriors of its base, of the same subjects.
        table: Output, accuracies of the network's own draws ("npe") and of the exact ones ("weighted").
        settings: Prior and number of draws.
        origin: Seed.

    Raises:
        ArtefactError: An input is no such artefact.
    """
    base = {place.subject: path for place, path in by_place(base_posteriors).items()}
    rows = []
    for path in posteriors:
        subject = place_of(path).subject
        found, exact = read_exact_result(path), read_exact_result(base[subject]).phi[: settings.draws]
        for sampler, phi in ((NETWORK, found.npe_phi), (WEIGHTED, found.phi)):
            seed = integer_seed(origin.seed, "population agreement", subject, sampler)
            accuracy = classifier_accuracy(phi[: settings.draws], exact, settings.prior, seed)
            rows.append({"subject": subject, "sampler": sampler, "draws": len(exact), "c2st": accuracy})
            LOGGER.info("subject %s, %s: C2ST %.3f", subject, sampler, accuracy)
    write_csv(table, pd.DataFrame(rows))

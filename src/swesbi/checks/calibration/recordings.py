"""Synthetic recordings of one subject, inferred by the network and exactly, and what checks need of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from swesbi.base.arrays import below_each_other
from swesbi.base.progress import Progress
from swesbi.checks.calibration.ranks import (
    Diagnostics,
    InferredRecordings,
    prior_variance,
    ranked,
    reference_points,
)
from swesbi.checks.calibration.settings import RecordingsSettings
from swesbi.draws import resampled_rows
from swesbi.measurement.likelihood import SpeedModel
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.synthetic import Synthetic
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import ExactSettings
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.misfits import misfits_of


def infer_recordings(
    model: SpeedModel,
    synthetic: Synthetic,
    flow: TrainedFlow,
    settings: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
    name: str,
) -> InferredRecordings:
    """Infer every recording by both samplers.

    Args:
        model: The subject's model; each recording takes the place of its own.
        synthetic: The recordings and their phi, n of them, at least one.
        flow: The trained network.
        settings: Sizes.
        exact: The study's own settings of the exact posterior.
        seed: Seed of the study.
        name: Name of this set of recordings, for its random streams.
    """
    subject, count = model.recording.subject, len(synthetic.phi)
    rng = generator(seed, "calibration", "tarp", name, subject)
    references = reference_points(count, model.settings.prior, rng)
    progress = Progress(f"calibration {subject} ({name})", count, unit="recording") if count > 1 else None
    variance, parts = prior_variance(model), []
    for index, recording in enumerate(synthetic.recordings):
        own, network = replace(model, recording=recording), flow_proposal(flow, recording)
        stream = integer_seed(seed, "calibration", "exact", name, subject, index)
        heart = HeartModel(own)
        by_network = heart.evaluated(
            network.draw(settings.network_draws, integer_seed(stream, "network"))
        ).phi
        drawn, by_mcmc = weighted_posterior(heart, network, settings.effective_draws, exact, stream)
        scores = ranked(
            own, own.log_likelihood, synthetic.phi[index], by_network, drawn, references[index], variance
        )
        rng = generator(stream, "misfit")
        predicted = own.predict(drawn.phi[resampled_rows(drawn.weight, settings.misfit_draws, rng)])
        diagnostics = Diagnostics(
            k_hat=np.array([drawn.k_hat]),
            efficiency=np.array([drawn.efficiency]),
            log_evidence=np.array([drawn.log_evidence]),
            by_mcmc=np.array([by_mcmc]),
        )
        misfits = misfits_of(own, drawn.phi, drawn.weight, predicted, rng)
        parts.append(InferredRecordings(scores, diagnostics, misfits))
        if progress:
            progress.step()
    return below_each_other(parts)

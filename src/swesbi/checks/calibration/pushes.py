"""Calibration on free-running recordings of fresh contexts, by how many pushes they have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
import xarray as xr

from swesbi import artefacts
from swesbi.base.arrays import BoolArray, FloatArray, rows_of
from swesbi.base.progress import Progress
from swesbi.checks.calibration.alarms import STRAINED_OR_WORSE, alarms
from swesbi.checks.calibration.ranks import (
    Ranked,
    prior_variance,
    ranked,
    reference_points,
)
from swesbi.checks.calibration.settings import JudgementSettings, PushesSettings, RecordingsSettings
from swesbi.checks.recovery import score_recovery
from swesbi.context import Context
from swesbi.draws import resampled_rows
from swesbi.networks.flow.flow import TrainedFlow, flow_proposal
from swesbi.parameters import PHI_NAMES
from swesbi.population.recordings import FreshSettings, record_pushes
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import JointPriorSettings
from swesbi.recording.observation import context_values, contexts_of
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.checks import STRIP_LABELS, Checks, check_recording
from swesbi.verdict.settings import RuleSettings

STREAM: Final = "pushes"
ALONG: Final = "recording"
LABELS: Final[dict[str, Any]] = {"parameter": list(PHI_NAMES), **STRIP_LABELS}
RESIDUAL_DRAWS: Final = 200  # posterior draws behind a p-value


@dataclass(frozen=True)
class InferredPushes:
    """n free-running recordings of fresh contexts, with what was inferred of each."""

    contexts: tuple[Context, ...]
    checks: Annotated[Checks, artefacts.Part()]
    k_hat: Annotated[FloatArray, artefacts.Variable("recording", "1", "Pareto shape of the weights")]
    efficiency: Annotated[
        FloatArray, artefacts.Variable("recording", "1", "effective share of the weighted draws")
    ]
    by_mcmc: Annotated[BoolArray, artefacts.Variable("recording", "1", "1 where MCMC took over")]
    ranked: Annotated[Ranked, artefacts.Part()]


def infer_pushes(
    index: Sequence[int],
    flow: TrainedFlow,
    fresh: FreshSettings,
    pushes: PushesSettings,
    sizes: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
) -> InferredPushes:
    """Record the numbered contexts once for each number of pushes, and infer every recording.

    Each recording has random streams of its own, so neither the order nor other numbers matter.

    Args:
        index: Numbers of the contexts.
        flow: The trained network.
        fresh: Population and model.
        pushes: How many pushes recordings have.
        sizes: Draws of each posterior.
        exact: The study's own settings of the exact posterior.
        seed: The study's seed.
    """
    asked = [(number, count) for number in index for count in pushes.pushes]
    progress = Progress("calibration on free-running recordings", len(asked), unit="recording")
    parts = []
    for number, count in asked:
        model, phi = record_pushes(number, (count, count), fresh, seed, STREAM, count)
        stream = integer_seed(seed, "calibration", STREAM, count, number)
        proposal, heart = flow_proposal(flow, model.recording), HeartModel(model)
        drawn, by_mcmc = weighted_posterior(heart, proposal, sizes.effective_draws, exact, stream)
        rng = generator(stream, "residuals")
        chosen = model.predict(drawn.phi[resampled_rows(drawn.weight, RESIDUAL_DRAWS, rng)])
        network = heart.evaluated(proposal.draw(sizes.network_draws, integer_seed(stream, "network"))).phi
        reference = reference_points(1, model.settings.prior, generator(stream, "tarp"))[0]
        variance = prior_variance(model)
        one = InferredPushes(
            contexts=(model.recording.context,),
            checks=check_recording(model, drawn.phi, drawn.weight, chosen, rng),
            k_hat=np.array([drawn.k_hat]),
            efficiency=np.array([drawn.efficiency]),
            by_mcmc=np.array([by_mcmc]),
            ranked=ranked(model, model.log_likelihood, phi, network, drawn, reference, variance),
        )
        parts.append(pushes_dataset(one))
        progress.step()
    return pushes_of(xr.concat(parts, dim=ALONG))


SCHEMA: Final = artefacts.schema_of(Context, ALONG)["/"] | artefacts.schema_of(InferredPushes)["/"]
KIND: Final = artefacts.register(
    "pushes_calibration", {"/": SCHEMA}, (*LABELS, *artefacts.labels_of(InferredPushes))
)


def pushes_dataset(inferred: InferredPushes) -> xr.Dataset:
    """Return the recordings as a dataset, a row a recording."""
    made = artefacts.to_dataset(inferred, LABELS)
    added = artefacts.build_dataset(
        artefacts.schema_of(Context, ALONG)["/"], context_values(inferred.contexts)
    )
    return made.assign(added.variables)


def pushes_of(dataset: xr.Dataset) -> InferredPushes:
    """Rebuild the recordings from a dataset."""
    return artefacts.from_dataset(InferredPushes, dataset, contexts=contexts_of(dataset, ALONG))


def read_pushes(paths: Sequence[Path]) -> InferredPushes:
    """Read parts, in the order given, as one.

    Raises:
        ArtefactError: A file is no such part.
    """
    return pushes_of(xr.concat([artefacts.load(path, KIND)[0] for path in paths], dim=ALONG))


def by_pushes(
    inferred: InferredPushes,
    null: Checks,
    prior: JointPriorSettings,
    judgement: JudgementSettings,
    rule: RuleSettings,
) -> pd.DataFrame:
    """Return coverage of each active parameter by number of pushes, and what sampler and tests did there.

    Args:
        inferred: The recordings.
        null: Null recordings, against which they are held: the share that is strained is of false alarms.
        prior: The prior.
        judgement: Nominal levels.
        rule: Levels of the verdict.
    """
    rows: list[dict[str, object]] = []
    pushes = inferred.checks.points
    raised = alarms(inferred.checks, null, rule)[STRAINED_OR_WORSE]
    strata = {"all": np.ones(len(pushes), dtype=bool)}
    strata |= {str(number): pushes == number for number in sorted(set(pushes.tolist()))}
    for name, chosen in strata.items():
        beside = {
            "median_efficiency": float(np.median(inferred.efficiency[chosen])),
            "by_mcmc": float(np.mean(inferred.by_mcmc[chosen])),
            "false_alarms": float(np.mean(raised[chosen])),
        }
        recovered = rows_of(inferred.ranked, chosen).recovered()
        rows += [
            {"pushes": name} | asdict(row) | beside
            for row in score_recovery(recovered, prior.theta, judgement)
        ]
    return pd.DataFrame(rows)

"""Calibration on free-running recordings of fresh contexts, by how many pushes they have."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Final, NamedTuple

import numpy as np
import pandas as pd

from swesbi import artefacts
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import BoolArray, FloatArray, below_each_other, rows_of
from swesbi.base.progress import Progress
from swesbi.checks.calibration.alarms import DOUBTFUL_OR_WORSE, alarms
from swesbi.checks.calibration.ranks import (
    RankedRecordings,
    prior_variance,
    ranked,
    reference_points,
)
from swesbi.checks.calibration.settings import JudgementSettings, PushesSettings, RecordingsSettings
from swesbi.checks.recovery import score_recovery
from swesbi.context import Context
from swesbi.draws import resampled_rows
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.recordings import FreshSettings, record_pushes
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import JointPriorSettings
from swesbi.recording.observation import context_values, contexts_of
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.misfits import STRIP_LABELS, Misfits, misfits_of
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.settings import RuleSettings

LOGGER = logging.getLogger("swesbi")
STREAM: Final = "pushes"
ALONG: Final = "recording"
OF_CONTEXTS: Final = artefacts.schema_of(Context, ALONG)["/"]
RESIDUAL_DRAWS: Final = 200  # posterior draws behind a p-value


@dataclass(frozen=True)
class InferredPushes(artefacts.Artefact, kind="pushes_calibration"):
    """n free-running recordings of fresh contexts, with what was inferred of each."""

    contexts: tuple[Context, ...]
    misfits: Annotated[Misfits, artefacts.Part()]
    k_hat: Annotated[FloatArray, artefacts.Variable("recording", "1", "Pareto shape of the weights")]
    efficiency: Annotated[
        FloatArray, artefacts.Variable("recording", "1", "effective share of the weighted draws")
    ]
    by_mcmc: Annotated[BoolArray, artefacts.Variable("recording", "1", "1 where MCMC took over")]
    ranked: Annotated[RankedRecordings, artefacts.Part()]

    labels = STRIP_LABELS

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": OF_CONTEXTS | artefacts.schema_of(cls)["/"]}

    def to_groups(self) -> dict[str, artefacts.Group]:
        """Return the content of the file, a row a recording."""
        contexts = artefacts.build_group(OF_CONTEXTS, context_values(self.contexts))
        return {"/": artefacts.to_groups(self, self.labels)["/"].joined(contexts)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, artefacts.Group], made: artefacts.Provenance) -> InferredPushes:
        """Return what the group of a file holds."""
        return artefacts.from_groups(cls, groups, {"contexts": contexts_of(groups["/"], ALONG)})

    @classmethod
    def joined(cls, parts: Sequence[InferredPushes]) -> InferredPushes:
        """Return several, in the order given."""
        contexts = tuple(context for part in parts for context in part.contexts)
        return replace(below_each_other(parts), contexts=contexts)


def infer_pushes(
    estimator: TrainedFlow,
    *,
    pushes_numbers: tuple[int, int],
    fresh: FreshSettings,
    free_running: PushesSettings,
    recordings: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
) -> InferredPushes:
    """Record the numbered contexts once for each number of pushes, and infer every recording.

    Each recording has random streams of its own, so neither the order nor other numbers matter.

    Args:
        estimator: The trained network.
        pushes_numbers: Numbers of the contexts, from the first to before the second.
        fresh: Population and model.
        free_running: How many pushes recordings have.
        recordings: Draws of each posterior.
        exact: The study's own settings of the exact posterior.
        seed: The study's seed.
    """
    asked = [(number, count) for number in range(*pushes_numbers) for count in free_running.pushes]
    progress = Progress("calibration on free-running recordings", len(asked), unit="recording")
    parts = []
    for number, count in asked:
        model, phi = record_pushes(number, (count, count), fresh, seed, STREAM, count)
        stream = integer_seed(seed, "calibration", STREAM, count, number)
        proposal, heart = flow_proposal(estimator, model.recording), HeartModel(model)
        drawn, by_mcmc = weighted_posterior(heart, proposal, recordings.effective_draws, exact, stream)
        rng = generator(stream, "residuals")
        chosen = model.predict(drawn.phi[resampled_rows(drawn.weight, RESIDUAL_DRAWS, rng)])
        by_network = proposal.draw(recordings.network_draws, integer_seed(stream, "network"))
        network = heart.evaluated(by_network).phi
        reference = reference_points(1, model.settings.prior, generator(stream, "tarp"))[0]
        variance = prior_variance(model)
        parts.append(
            InferredPushes(
                contexts=(model.recording.context,),
                misfits=misfits_of(model, drawn.phi, drawn.weight, chosen, rng),
                k_hat=np.array([drawn.k_hat]),
                efficiency=np.array([drawn.efficiency]),
                by_mcmc=np.array([by_mcmc]),
                ranked=ranked(model, model.log_likelihood, phi, network, drawn, reference, variance),
            )
        )
        progress.step()
    return InferredPushes.joined(parts)


class PushesScores(NamedTuple):
    """Free-running recordings of fresh contexts, and their coverage.

    Attributes:
        calibration: All recordings together.
        table: A row a number of pushes, parameter and nominal level.
    """

    calibration: InferredPushes
    table: PlainTable


def scores_on_pushes(
    parts: InferredPushes,
    null: NullRecordings,
    *,
    joint_prior: JointPriorSettings,
    judgement: JudgementSettings,
    rule: RuleSettings,
) -> PushesScores:
    """Score free-running recordings of fresh contexts by number of pushes; arguments as of ``by_pushes``."""
    LOGGER.info(
        "%d free-running recordings: median efficiency %.0f %%, %d by MCMC",
        len(parts.by_mcmc), 100.0 * float(np.median(parts.efficiency)), int(parts.by_mcmc.sum()),
    )  # fmt: skip
    return PushesScores(parts, by_pushes(parts, null.pushes, joint_prior, judgement, rule))


def by_pushes(
    inferred: InferredPushes,
    null: Misfits,
    prior: JointPriorSettings,
    judgement: JudgementSettings,
    rule: RuleSettings,
) -> pd.DataFrame:
    """Return coverage of each active parameter by number of pushes, and what sampler and tests did there.

    Args:
        inferred: The recordings.
        null: Null recordings, against which they are held: the share that is doubtful is of false alarms.
        prior: The prior.
        judgement: Nominal levels.
        rule: Levels of the verdict.
    """
    rows: list[dict[str, object]] = []
    pushes = inferred.misfits.points
    raised = alarms(inferred.misfits, null, rule)[DOUBTFUL_OR_WORSE]
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

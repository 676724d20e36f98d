"""Calibration on free-running recordings of fresh contexts, by how many pushes they have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
import xarray as xr

from swesbi import artefacts
from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.base.progress import Progress
from swesbi.checks.calibration.ranks import (
    Ranked,
    prior_variance,
    quantities,
    quantity_names,
    reference_points,
    score,
    stack_scores,
)
from swesbi.checks.calibration.settings import JudgementSettings, PushesSettings, RecordingsSettings
from swesbi.checks.free_predictive import draw_pushes as draw_speeds_of_pushes
from swesbi.checks.recovery import score_recovery
from swesbi.context import Context
from swesbi.draws import equal_weights, resampled_rows
from swesbi.measurement.instants import FreeModel
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.flow.flow import TrainedFlow, free_proposal
from swesbi.parameters import PHI_NAMES
from swesbi.population.conditions import draw_pushes
from swesbi.population.contexts import draw_contexts
from swesbi.population.recordings import FreshSettings
from swesbi.population.synthetic import fresh_beats
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import PriorSettings
from swesbi.recording.observation import context_values, contexts_of
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.without_null import residual_test

STREAM: Final = "pushes"
ALONG: Final = "recording"
LABELS: Final[dict[str, Any]] = {"parameter": list(PHI_NAMES)}
RESIDUAL_DRAWS: Final = 200  # posterior draws behind a p-value


@dataclass(frozen=True)
class InferredPushes:
    """n free-running recordings of fresh contexts, with what was inferred of each."""

    contexts: tuple[Context, ...]
    pushes: Annotated[IntArray, artefacts.Variable("recording", "1", "accepted pushes")]
    errors_log_sd: Annotated[
        FloatArray,
        artefacts.Variable("recording", "1", "prior sd of the log of a factor of all errors, 0 where known"),
    ]
    k_hat: Annotated[FloatArray, artefacts.Variable("recording", "1", "Pareto shape of the weights")]
    efficiency: Annotated[
        FloatArray, artefacts.Variable("recording", "1", "effective share of the weighted draws")
    ]
    by_mcmc: Annotated[BoolArray, artefacts.Variable("recording", "1", "1 where MCMC took over")]
    residual_p_value: Annotated[
        FloatArray, artefacts.Variable("recording", "1", "posterior predictive p-value of the residuals")
    ]
    ranked: Annotated[Ranked, artefacts.Part()]


@dataclass(frozen=True)
class PushesStudy:
    """Where free-running recordings come from, and how they are inferred.

    Attributes:
        fresh: Population and model.
        pushes: How many recordings of how many pushes.
        sizes: Draws of each posterior.
        exact: The study's own settings of the exact posterior.
        rule: Levels of the verdict.
        seed: The study's seed.
    """

    fresh: FreshSettings
    pushes: PushesSettings
    sizes: RecordingsSettings
    exact: ExactSettings
    rule: RuleSettings
    seed: int

    def infer(self, index: Sequence[int], flow: TrainedFlow) -> InferredPushes:
        """Record the numbered contexts once for each number of pushes, and infer every recording.

        Each recording has random streams of its own, so neither the order nor other numbers matter.
        """
        asked = [(number, pushes) for number in index for pushes in self.pushes.pushes]
        progress = Progress("calibration on free-running recordings", len(asked), unit="recording")
        parts = []
        for number, pushes in asked:
            parts.append(self._infer(number, pushes, flow))
            progress.step()
        return _joined(parts)

    def _infer(self, number: int, pushes: int, flow: TrainedFlow) -> InferredPushes:
        model, phi = self.recorded(number, pushes)
        seed = integer_seed(self.seed, "calibration", STREAM, pushes, number)
        network_posterior = free_proposal(flow, model)
        drawn, by_mcmc = weighted_posterior(
            model, network_posterior, self.sizes.effective_draws, self.exact, seed
        )
        rng = generator(seed, "residuals")
        chosen = drawn.phi[resampled_rows(drawn.weight, RESIDUAL_DRAWS, rng)]
        test = residual_test(model, model.model.predict(chosen), self.rule, rng)
        network = flow_draws(flow, model, self.sizes.network_draws, seed)
        return InferredPushes(
            contexts=(model.model.recording.context,),
            pushes=np.array([pushes]),
            errors_log_sd=np.array([model.noise_log_sd]),
            k_hat=np.array([drawn.k_hat]),
            efficiency=np.array([drawn.efficiency]),
            by_mcmc=np.array([by_mcmc]),
            residual_p_value=np.array([test.p_value]),
            ranked=_ranked(model, phi, network, (drawn.phi, drawn.weight, drawn.log_likelihood), seed),
        )

    def recorded(self, number: int, pushes: int) -> tuple[FreeModel, FloatArray]:
        """Draw context, instants, errors, phi of shape (d,) and speeds of one free-running recording."""
        name = (STREAM, pushes)
        context = draw_contexts([number], self.fresh.population, self.seed, "fresh", *name)[0]
        rng = generator(self.seed, "population conditions", *name, number)
        asked = self.fresh.conditions.free_running.model_copy(update={"pushes": (pushes, pushes)})
        drawn = draw_pushes(1, asked, rng)
        order = np.argsort(drawn.phase, kind="stable")
        phase, se = drawn.phase[order], drawn.relative_se[order]
        blank = SpeedRecording(context, phase, np.ones(pushes), drawn.factor[0] * se, np.empty((pushes, 0)))
        cells = self.fresh.acquisition.phases
        cell = np.minimum((phase * cells).astype(np.int64), cells - 1)
        known = FreeModel(SpeedModel(blank, self.fresh.model), cell, 0.0)
        phi, beats = fresh_beats(known.model, 1, self.seed, *name)
        speed = draw_speeds_of_pushes(known, known.model.predict_from(phi, beats), rng)[0]
        seen = replace(known.model, recording=replace(blank, speed_m_s=speed, relative_se=se))
        return FreeModel(seen, cell, float(drawn.errors_log_sd[0])), phi[0]


def flow_draws(flow: TrainedFlow, model: FreeModel, draws: int, seed: int) -> FloatArray:
    """Return the network's own draws of phi; shape (draws, d)."""
    return free_proposal(flow, model).draw(draws, integer_seed(seed, "network"))


def _ranked(
    model: FreeModel,
    phi: FloatArray,
    network: FloatArray,
    drawn: tuple[FloatArray, FloatArray, FloatArray],
    seed: int,
) -> Ranked:
    """Rank the true phi (d,) among the network's draws, and among weighted ones with log-likelihoods."""
    prior, plain = model.settings.prior, model.model
    exact_phi, weight, log_likelihood = drawn
    both = np.concatenate([phi[None], network])
    truth, *rest = quantities(both, model.log_likelihood(both), plain.activation_duration_s(both))
    values = quantities(exact_phi, log_likelihood, plain.activation_duration_s(exact_phi))
    reference = reference_points(1, prior, generator(seed, "tarp"))[0]
    of_network = np.stack(rest)
    by_network = score(truth, of_network, equal_weights(len(of_network)), reference, prior)
    return Ranked(
        names=quantity_names(prior),
        subject=np.array([plain.recording.subject]),
        truth=truth[None],
        prior_variance=prior_variance(plain)[None],
        network=stack_scores([by_network]),
        weighted=stack_scores([score(truth, values, weight, reference, prior)]),
    )


def _joined(parts: Sequence[InferredPushes]) -> InferredPushes:
    return pushes_of(xr.concat([pushes_dataset(part) for part in parts], dim=ALONG))


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
    inferred: InferredPushes, prior: PriorSettings, judgement: JudgementSettings, level: float
) -> pd.DataFrame:
    """Return coverage of each active parameter by number of pushes, and what sampler and tests did there.

    Args:
        inferred: The recordings.
        prior: Prior of theta, against which contraction is taken.
        judgement: Nominal levels.
        level: At which the residuals are held against the model: the share that is, is of false alarms.
    """
    rows: list[dict[str, object]] = []
    strata = {"all": np.ones(len(inferred.pushes), dtype=bool)}
    strata |= {str(number): inferred.pushes == number for number in sorted(set(inferred.pushes.tolist()))}
    for name, chosen in strata.items():
        beside = {
            "median_efficiency": float(np.median(inferred.efficiency[chosen])),
            "by_mcmc": float(np.mean(inferred.by_mcmc[chosen])),
            "residuals_flagged": float(np.mean(inferred.residual_p_value[chosen] <= 0.5 * level)),
        }
        recovered = inferred.ranked.rows(chosen).recovered
        rows += [
            {"pushes": name} | asdict(row) | beside for row in score_recovery(recovered, prior, judgement)
        ]
    return pd.DataFrame(rows)

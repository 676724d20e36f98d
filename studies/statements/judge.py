"""One set of networks judges recordings: the study's own stages in memory, up to the paper's statements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd
from pydantic import JsonValue

from studies.statements.recorded import Rerecorded
from studies.statements.recovery import ExperimentSettings, known_recordings
from studies.statements.settings import Epoch
from swesbi.checks.cmaes import CmaesFit, reference_fit
from swesbi.checks.predictive_features import check_of_features
from swesbi.checks.recovery import posterior_seed, recovery_table
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.networks.paper.estimator import TrainedEstimator, draw_candidates, draw_until
from swesbi.networks.paper.pool import Pool, with_context
from swesbi.population.recordings import features_under
from swesbi.posterior.truncated import Posterior, summarise_posterior
from swesbi.report.paper.values import Findings
from swesbi.report.study_tables import Case, features_table, posterior_table, ppc_table
from swesbi.seeds import integer_seed
from swesbi.study.job import typed_settings
from swesbi.verdict.prior_support import diagnose
from swesbi.verdict.verdict import Verdict


@dataclass(frozen=True)
class Network:
    """A trained network of one experiment after one epoch, with the prior's simulations by subject."""

    own: ExperimentSettings
    pool: Pool
    net: TrainedEstimator
    simulations: Mapping[str, PriorSimulations]


def chosen(nets: Sequence[TrainedEstimator], epoch: Epoch) -> TrainedEstimator:
    """Return the network of the epoch that is asked for."""
    if epoch == "best":
        return next(net for net in nets if net.best)
    if epoch == "last":
        return max(nets, key=lambda net: net.epoch)
    found = [net for net in nets if net.epoch == epoch]
    if not found:
        epochs = ", ".join(str(net.epoch) for net in nets)
        raise ValueError(f"epoch {epoch} has no checkpoint; there are those of {epochs}")
    return found[0]


def recoveries(
    networks: Mapping[str, Network],
    subjects: Sequence[MeasuredSubject],
    how: str,
    exponent_b: float,
    seed: int,
) -> dict[str, pd.DataFrame]:
    """Return the recovery of each experiment's network, as ``recovery.csv`` has it."""
    found = {}
    for name, network in networks.items():
        own = network.own
        truth, z = known_recordings(subjects, network.pool, own, how, exponent_b, seed)
        candidates = draw_candidates(network.net, z, own.recovery.candidate_draws, posterior_seed(seed))
        found[name] = recovery_table(truth, candidates, own.prior, own.recovery)
    return found


def findings(
    recordings: Sequence[Rerecorded],
    networks: Mapping[str, Network],
    recovered: Mapping[str, pd.DataFrame],
    main: str,
    cmaes: Mapping[str, JsonValue],
    cohort_title: str,
    seed: int,
) -> Findings:
    """Return what the networks find on recordings of one acquisition, in the cohort's order.

    Other experiments than the main one are of the subjects whose posterior may be read there. Draws are those
    that the study of this seed makes.
    """
    fits = {
        each.name: reference_fit(
            each.subject.observation, each.subject.passive, **typed_settings(reference_fit, cmaes)
        )
        for each in recordings
    }
    of_main = [_case(main, each, networks[main], fits, seed) for each in recordings]
    supported = [each for each, case in zip(recordings, of_main, strict=True) if case.verdict.may_be_read]
    cases = [*of_main]
    for name, network in networks.items():
        if name != main:
            cases += [_case(name, each, network, fits, seed) for each in supported]
    return Findings(
        cohort_title=cohort_title,
        main=main,
        ppc=ppc_table(cases),
        posterior=posterior_table(cases),
        features=features_table(cases),
        verdicts={case.subject: case.verdict for case in of_main},
        recoveries=recovered,
    )


def _case(
    experiment: str, recorded: Rerecorded, network: Network, fits: Mapping[str, CmaesFit], seed: int
) -> Case:
    """Return one subject in one experiment: what the stages posterior and predictive find."""
    own, (verdict, posterior) = network.own, _inferred(recorded, network, seed)
    check = check_of_features(
        posterior,
        verdict,
        recorded.subject.observation,
        recorded.subject.passive,
        network.simulations[recorded.name],
        predictive=own.predictive,
        forward_model=own.forward_model,
        measurement=own.measurement,
        summary=own.summary,
        observation_model=own.observation_model,
        seed=seed,
    )
    return Case(experiment, recorded.name, check, posterior, verdict, fits[recorded.name])


def _inferred(recorded: Rerecorded, network: Network, seed: int) -> tuple[Verdict, Posterior]:
    """Draw candidates until the posterior has its draws; under the shipped recording they are the study's."""
    own, observation = network.own, recorded.subject.observation
    features = features_under(
        recorded.trained.passive,
        observation,
        recorded.subject.passive,
        own.measurement,
        own.summary,
    )
    z = network.pool.standardisation.apply(with_context(features[None], observation.context))[0]
    names, prior = network.pool.components.names, own.prior
    enough = max(own.support.min_in_prior_draws, own.posterior.draws)
    drawn_by = integer_seed(seed, "posterior", recorded.name)
    candidates = draw_until(network.net, z, enough, own.support.candidate_draws, prior, drawn_by)
    verdict = diagnose(z, names, candidates, prior, own.support)
    return verdict, summarise_posterior(candidates, z, names, prior, own.posterior)

"""The verdict on a subject, and the null recordings among which its recording is judged."""

from __future__ import annotations

import logging
from pathlib import Path

from swesbi.artefacts import ArtefactError, Origin, save, write_json
from swesbi.base.settings import Settings
from swesbi.context import Context
from swesbi.measurement.likelihood import read_speed_model
from swesbi.networks.flow.files import load_flow
from swesbi.population.recordings import FreshSettings
from swesbi.population.settings import NullSettings
from swesbi.posterior.result import read_exact_posterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.observation import Contexts, Observation
from swesbi.verdict.null_recordings import KIND, draw_nulls, null_groups, read_nulls
from swesbi.verdict.with_null import VerdictSettings, judge

LOGGER = logging.getLogger("swesbi")


class PopulationNullStageSettings(Settings):
    """What the nulls depend on."""

    fresh: FreshSettings
    sizes: NullSettings
    exact: ExactSettings


def population_null(
    *, estimator: Path, null: Path, settings: PopulationNullStageSettings, origin: Origin
) -> None:
    """Make well-specified recordings of fresh contexts, infer each, and keep what the tests look at.

    Raises:
        ArtefactError: The network is no such artefact.
    """
    flow, _ = load_flow(estimator)
    drawn = draw_nulls(flow, settings.fresh, settings.sizes, settings.exact, origin.seed)
    save(null, null_groups(drawn), origin.provenance(KIND, settings))


def verdict(
    *,
    posterior: Path,
    null: Path,
    observation: Path,
    contexts: Path,
    noise: Path,
    verdict: Path,
    settings: VerdictSettings,
    origin: Origin,
) -> None:
    """Judge the recording of ``origin.subject`` and write one verdict with the tests behind it.

    Args:
        posterior: The exact posterior of the recording.
        null: Null recordings.
        observation: The recording.
        contexts: Those of the whole cohort, with which this subject's is compared.
        noise: The cohort's noise.
        verdict: Output.

    Raises:
        ArtefactError: An input is no such artefact, or the contexts do not hold the subject's.
    """
    others, nulls = _others(contexts, origin.subject), read_nulls(null)
    model = read_speed_model(observation, noise, settings.model)
    clinical, exact = Observation.read(observation).clinical, read_exact_posterior(posterior)
    beats = model.simulate(exact.phi)
    result = judge(exact, model, beats, nulls, others, settings, origin.seed, clinical)
    write_json(verdict, result.to_json())
    LOGGER.info("subject %s: %s", origin.subject, result.sentence)


def _others(path: Path, subject: str) -> list[Context]:
    """Return the contexts of the other subjects."""
    contexts = Contexts.read(path).of
    others = [context for context in contexts if context.subject != subject]
    if len(others) != len(contexts) - 1:
        names = ", ".join(context.subject for context in contexts)
        raise ArtefactError(f"{path}: needs the context of subject {subject}; it holds those of {names}")
    return others

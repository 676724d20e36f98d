"""Answers with the pressures of a cuff, beside those on the speeds alone."""

from __future__ import annotations

from pathlib import Path

from swesbi.answers.answer import informed
from swesbi.answers.settings import PressuresSettings
from swesbi.artefacts import Origin, save
from swesbi.measurement.clinical import with_pressures
from swesbi.measurement.likelihood import build_speed_model
from swesbi.posterior.result import exact_to_groups, read_exact_posterior
from swesbi.posterior.truncated import POSTERIOR
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation

STREAM = "pressures"


def pressures(
    *,
    observation: Path,
    noise: Path,
    of_speeds: Path,
    posterior: Path,
    settings: PressuresSettings,
    origin: Origin,
) -> None:
    """Infer a subject from speeds and cuff pressures, from its posterior of the speeds on.

    Args:
        observation: Observed curve, with pressures.
        noise: Noise of the cohort.
        of_speeds: The posterior of the speeds alone.
        posterior: Output.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: Every simulation fails.
        ValueError: The subject has no pressures.
    """
    speeds = build_speed_model(observation, CohortNoise.read(noise), settings.exact_posterior.model)
    model = with_pressures(speeds, Observation.read(observation).clinical, settings.clinical)
    names = (STREAM, "pressures", origin.subject)
    known = read_exact_posterior(of_speeds).weighted
    exact = informed(model, known, settings.exact_posterior.exact, origin.seed, *names)
    groups = exact_to_groups(exact, model.settings.prior)
    save(posterior, groups, origin.provenance(POSTERIOR, settings))

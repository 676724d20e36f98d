"""The verdict on a subject of the study."""

from __future__ import annotations

from swesbi.artefacts import UnfitError
from swesbi.base.progress import LOGGER
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Contexts, Observation
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.recording import VerdictSettings, judge
from swesbi.verdict.settings import EjectionTimeSettings, RuleSettings
from swesbi.verdict.verdict import Verdict


def verdict_on_subject(
    posterior: ExactPosterior,
    null: NullRecordings,
    observation: Observation,
    contexts: Contexts,
    noise: CohortNoise,
    *,
    model: SpeedModelSettings,
    rule: RuleSettings,
    ejection_time: EjectionTimeSettings,
    lvet_sd_ms: float,
    seed: int,
) -> Verdict:
    """Judge a recording of a subject, whose context is compared with those of the rest of the cohort."""
    others, recorded = others_than(observation.subject, contexts), speed_model(observation, noise, model)
    settings = VerdictSettings(model=model, rule=rule, ejection_time=ejection_time, lvet_sd_ms=lvet_sd_ms)
    beats = recorded.simulate(posterior.phi)
    verdict = judge(posterior, recorded, beats, null, others, settings, seed, observation.clinical)
    LOGGER.info("subject %s: %s", observation.subject, verdict.sentence)
    return verdict


def others_than(subject: str, contexts: Contexts) -> list[Context]:
    """Return the contexts of the other subjects; raise ArtefactError where the subject is not among them."""
    others = [context for context in contexts.of if context.subject != subject]
    if len(others) != len(contexts.of) - 1:
        names = ", ".join(context.subject for context in contexts.of)
        raise UnfitError("contexts", f"needs the context of subject {subject}; it holds those of {names}")
    return others

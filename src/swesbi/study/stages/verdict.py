"""The verdict on one subject, and how often the tests behind it raise an alarm."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from swesbi.artefacts import ArtefactError, write_json
from swesbi.base import Settings
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.settings import SummarySettings
from swesbi.measurement.subjects import read_speed_model
from swesbi.networks.spline.conditioning import ConditioningSettings, conditioning_of
from swesbi.parameters import SCALE
from swesbi.posterior.result import ExactResult, read_exact_result
from swesbi.posterior.truncated import read_posterior
from swesbi.recording.observation import read_contexts
from swesbi.seeds import generator
from swesbi.show.csv import write_csv
from swesbi.study.stages.origin import Origin
from swesbi.verdict.context import context_tests
from swesbi.verdict.nulls import Reference, Verdict
from swesbi.verdict.power import COHORT, STRAINED_OR_WORSE, alarm_rows
from swesbi.verdict.recordings import ACQUIRED, OWN, read_subject_checks
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.statistics import Checks, PosteriorDraws, check_recording
from swesbi.verdict.support import Support, SupportTest
from swesbi.verdict.verdict import grade, make_support, null_tests, volume_tests

LOGGER = logging.getLogger("swesbi")


class VerdictStageSettings(Settings):
    """What the verdict depends on."""

    model: SpeedModelSettings
    summary: SummarySettings
    strip_fraction: float
    rule: RuleSettings

    @property
    def conditioning(self) -> ConditioningSettings:
        """How measured speeds become features."""
        return conditioning_of(self.summary, self.model)


def verdict(
    *,
    posterior: Path,
    misspecification: Path,
    observation: Path,
    contexts: Path,
    noise: Path,
    support: Path,
    settings: VerdictStageSettings,
    origin: Origin,
) -> None:
    """Judge the recording of ``origin.subject`` and write one verdict with the tests behind it.

    Args:
        posterior: The exact posterior of the recording.
        misspecification: The null distributions of the subject.
        observation: The recording.
        contexts: Those of the whole cohort, with which this subject's is compared.
        noise: The cohort's noise.
        support: Output.

    Raises:
        ArtefactError: An input is no such artefact, or the contexts do not hold the subject's.
    """
    others = _others(contexts, origin.subject)
    model = read_speed_model(observation, noise, settings.model)
    reference = read_subject_checks(misspecification).reference(settings.rule)
    result = judge(posterior, model, others, reference, settings, origin)
    write_json(support, result.to_json())
    LOGGER.info("subject %s: %s", origin.subject, result.verdict)


def judge(
    posterior: Path,
    model: SpeedModel,
    others: Sequence[Context],
    reference: Reference,
    settings: VerdictStageSettings,
    origin: Origin,
    further: Sequence[SupportTest] = (),
) -> Support:
    """Judge the recording of ``model`` by the tests of ``reference``, its volumes and its context.

    Args:
        posterior: The exact posterior of the recording.
        model: The recording and its model.
        others: Contexts with which the subject's is compared.
        reference: Null distributions.
        further: Other tests, which can strain the subject.
    """
    exact, context = read_exact_result(posterior), model.recording.context
    beats = model.simulate(exact.phi)
    checks = _check(model, exact, beats, settings, origin)
    judgement = reference.judge(checks)
    volumes = volume_tests(beats, context, settings.rule.volumes)
    contextual = (*context_tests(context, others, settings.rule.context), *further)
    status = grade(Verdict(judgement.status[0]), volumes, contextual, settings.rule.volumes.unsupported_abs_z)
    tests = (*null_tests(reference, checks, judgement), *volumes, *contextual)
    summary = read_posterior(posterior)
    overall_p = float(judgement.overall_p[0])
    return make_support(status, overall_p, tests, summary.z_obs, summary.component_names, exact)


def _others(path: Path, subject: str) -> list[Context]:
    """Return the contexts of the other subjects."""
    contexts = read_contexts(path)
    others = [context for context in contexts if context.subject != subject]
    if len(others) != len(contexts) - 1:
        names = ", ".join(context.subject for context in contexts)
        raise ArtefactError(f"{path}: needs the context of subject {subject}; it holds those of {names}")
    return others


def _check(
    model: SpeedModel, exact: ExactResult, beats: Beats, settings: VerdictStageSettings, origin: Origin
) -> Checks:
    """Return what the tests look at in the recording, from the equally weighted exact draws."""
    works = beats.status == Status.PERIODIC
    draws = PosteriorDraws(
        phi=exact.phi,
        weight=works / works.sum(),
        predicted=model.predict_from(exact.phi[:, SCALE], beats),
        k_hat=exact.k_hat,
        efficiency=exact.efficiency,
    )
    rng = generator(origin.seed, "verdict", origin.subject)
    return check_recording(model, draws, settings.conditioning, settings.strip_fraction, rng)


class MisspecificationTableStageSettings(Settings):
    """The rule whose alarms are counted."""

    rule: RuleSettings


def misspecification_table(
    *,
    misspecifications: Sequence[Path],
    table: Path,
    settings: MisspecificationTableStageSettings,
    origin: Origin,
) -> None:
    """Count alarms on well-specified recordings and on the virtual volunteers recorded anew.

    Raises:
        ArtefactError: An input is no such artefact.
    """
    rows = alarm_rows([read_subject_checks(path) for path in misspecifications], settings.rule)
    write_csv(table, pd.DataFrame([asdict(row) for row in rows]), float_format=None)
    for row in rows:
        if row.alarm == STRAINED_OR_WORSE and (
            row.subject == COHORT or row.recordings not in (OWN, ACQUIRED)
        ):
            LOGGER.info("%s, %s: alarm on %.1f %% of %d", row.subject, row.recordings, 100 * row.rate, row.n)

"""Two visits of one person, each answered already: what has changed between them."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.answers.knowledge import Knowledge
from swesbi.artefacts import Origin, save, to_groups
from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Settings
from swesbi.draws import median_and_interval
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.flow.files import load_flow
from swesbi.persons.change.joint import Change, OwnPosterior, infer_change
from swesbi.persons.change.settings import ChangeSettings
from swesbi.persons.change.stored import KIND, StoredChange, Visits, change_table, stored_change
from swesbi.persons.change.visits import VisitsModel, visits_model
from swesbi.posterior.result import ExactPosterior, read_exact_posterior
from swesbi.posterior.space import Space
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import Observation, read_observation
from swesbi.recording.protocol import read_repeats
from swesbi.recording.speed import youngs_modulus_kpa
from swesbi.report.csv import write_csv
from swesbi.report.figures.change import ShownVisit, draw_change, draw_change_sheet
from swesbi.report.figures.style import save_figure
from swesbi.study.observing import known_noise
from swesbi.verdict.verdict import Verdict, read_verdict

LOGGER = logging.getLogger("swesbi")
SHOWN_DRAWS: Final = 500
SHOWN_PHASES: Final = 100


class PersonChangeStageSettings(Settings):
    """What the change of a person depends on beside the answers to both visits."""

    model: SpeedModelSettings
    changes: ChangeSettings
    person: str
    visits: tuple[str, str]
    cohort_title: str


@dataclass(frozen=True)
class ChangeFiles:
    """What a person's change is inferred from, and what is written of it.

    Attributes:
        observations: Observed curves of both visits, the earlier first.
        posteriors: Their exact posteriors.
        verdicts: Their verdicts.
        protocol: ``recording.yaml`` of their cohort.
        estimator: The network that answered both.
        noise: Noise from which standard errors are told.
        pooled_observations: Observed curves of the cohort that the network was trained on; none where that
            was a population.
        joint: Output, ``change.h5``.
        table: Output, a row a quantity.
        figure_pdf: Output.
        figure_png: Output.
        sheet: Output, one page of the person.
    """

    observations: Sequence[Path]
    posteriors: Sequence[Path]
    verdicts: Sequence[Path]
    protocol: Path
    estimator: Path
    noise: Path
    pooled_observations: Sequence[Path]
    joint: Path
    table: Path
    figure_pdf: Path
    figure_png: Path
    sheet: Path


def person_change(*, files: ChangeFiles, settings: PersonChangeStageSettings, origin: Origin) -> None:
    """Infer two visits of one person together, and say what has changed between them.

    Raises:
        ValueError: The visits have different protocols.
        NoLikelihoodError: No draw of both visits has a likelihood.
        ArtefactError: A file is no such artefact.
    """
    observed = [read_observation(path) for path in files.observations]
    check_protocols(observed, settings.visits)
    known = known_noise(read_repeats(files.protocol), read_noise(files.noise).components)
    models = [SpeedModel(measured_speeds(each, known), settings.model) for each in observed]
    found = _inferred(models, observed, files, settings, origin)
    judged = [read_verdict(path) for path in files.verdicts]
    subjects, words = _two([each.subject for each in observed]), _two([each.status for each in judged])
    visits = Visits(settings.person, settings.visits, subjects, words)
    stored = stored_change(found, visits, settings.model.prior.names, settings.changes)
    save(files.joint, to_groups(stored), origin.provenance(KIND, settings))
    write_csv(files.table, change_table(stored))
    shown = [
        _shown(*each, stored.interval_mass) for each in zip(models, observed, found.phi, judged, strict=True)
    ]
    save_figure(draw_change(stored, shown, settings.cohort_title), files.figure_pdf, files.figure_png)
    save_figure(draw_change_sheet(stored, shown, settings.cohort_title), files.sheet)
    _report(stored, found.efficiency)


def _inferred(
    models: Sequence[SpeedModel],
    observed: Sequence[Observation],
    files: ChangeFiles,
    settings: PersonChangeStageSettings,
    origin: Origin,
) -> Change:
    """Infer both visits together, from their own posteriors on."""
    contexts = [read_observation(path).context for path in files.pooled_observations]
    knowledge = Knowledge(flow=load_flow(files.estimator)[0], trained=contexts)
    own = [
        own_posterior(read_exact_posterior(path), knowledge.space(model))
        for path, model in zip(files.posteriors, models, strict=True)
    ]
    both = both_visits(models, observed, settings.changes)
    names = (settings.person, *(each.subject for each in observed))
    return infer_change(both, own, settings.changes, origin.seed, *names)


def check_protocols(observed: Sequence[Observation], visits: Sequence[str]) -> None:
    """Refuse visits that were gated at different numbers of phases.

    Raises:
        ValueError: Says how many each has.
    """
    phases = [len(each.phase) for each in observed]
    if len(set(phases)) > 1:
        had = ", ".join(f"{visit!r} {number}" for visit, number in zip(visits, phases, strict=True))
        raise ValueError(
            f"gated phases by visit: {had}; visits are compared phase by phase, so both need the same "
            "protocol"
        )


def own_posterior(exact: ExactPosterior, space: Space) -> OwnPosterior:
    """Return what the joint posterior begins with: a visit's own, and the space of its network."""
    by_weights = exact.sampler == "importance"
    effective = exact.efficiency * len(exact.weighted.phi) if by_weights else exact.effective_draws.min()
    return OwnPosterior(exact.phi, float(min(effective, len(exact.phi))), exact.log_evidence, space)


def both_visits(
    models: Sequence[SpeedModel], observed: Sequence[Observation], settings: ChangeSettings
) -> VisitsModel:
    """Return the model of two visits of one person, in what they share as configured."""
    shares = settings.shares
    return visits_model(
        models,
        [each.phase_index[each.measured] for each in observed],
        shares.of(models[0].settings.prior.names),
        shares.discrepancy,
    )


def _two(names: Iterable[str]) -> tuple[str, str]:
    first, second = names
    return first, second


def _shown(
    model: SpeedModel, observed: Observation, phi: FloatArray, verdict: Verdict, mass: float
) -> ShownVisit:
    """Return a visit with the band of its curve under the joint posterior, at even phases."""
    phase = (np.arange(SHOWN_PHASES) + 0.5) / SHOWN_PHASES
    densely = replace(model, recording=replace(model.recording, phase=phase))
    speed = densely.predict(phi[:SHOWN_DRAWS]).speed_m_s
    known = speed[np.isfinite(speed).all(axis=1)]
    kpa = youngs_modulus_kpa(known, model.settings.density_kg_m3)
    low, median, high = median_and_interval(kpa, mass)
    return ShownVisit(observed, verdict, phase, low, median, high)


def _report(stored: StoredChange, efficiency: Sequence[float]) -> None:
    rounds = ", ".join(f"{share:.1%}" for share in efficiency)
    LOGGER.info("efficiency of the first proposal for both visits and of each after it: %s", rounds)
    LOGGER.info(
        "%s, %s to %s: draws by %s; k-hat %.2f, efficiency %.1f %%",
        stored.person, *stored.visit, stored.sampler, stored.k_hat, 100.0 * stored.efficiency,
    )  # fmt: skip
    if stored.reasons:
        LOGGER.log(logging.INFO if stored.converged else logging.WARNING, "  %s", stored.reasons)

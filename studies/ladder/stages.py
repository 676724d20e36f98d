"""The ladder: the same recordings under one structure after the other, and what they come to together."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pydantic import Field

from studies.ladder.figure import draw_ladder
from studies.ladder.infer import Rung, infer_structure, second_recording
from studies.ladder.posteriors import KIND, read_structure, to_groups
from studies.ladder.proposal import first_proposal
from studies.ladder.settings import LadderEffort
from studies.ladder.summary import moves_table, pairs_table
from studies.ladder.table import ABOUT_PEOPLE, ladder_table
from swesbi.artefacts import Origin, save
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.measurement.likelihood import SpeedModelSettings, read_speed_models
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import flow_proposal
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import PlacedProposal
from swesbi.report.figures.style import save_figure

LOGGER = logging.getLogger("swesbi")


class LadderRunStageSettings(Settings):
    """What the posteriors under one structure depend on: its model, the study's own, and the effort."""

    base: SpeedModelSettings
    model: SpeedModelSettings
    exact: ExactSettings
    effort: LadderEffort


def ladder_run(
    *,
    observations: Sequence[Path],
    noise: Path,
    estimator: Path,
    posteriors: Path,
    settings: LadderRunStageSettings,
    origin: Origin,
) -> None:
    """Infer every subject under one structure, at the shipped discrepancy and at one chosen anew.

    The network of the study gives first proposals only; none is trained.

    Raises:
        ArtefactError: An input is no such artefact.
        ValueError: The network infers other parameters, or a person cannot be changed as configured.
        NoLikelihoodError: Every simulation of a recording fails.
    """
    flow, _ = load_flow(estimator)

    def first(recording: SpeedRecording) -> PlacedProposal:
        return first_proposal(flow_proposal(flow, recording), settings.model.prior.simulated)

    own = read_speed_models(observations, noise, settings.base)
    models = read_speed_models(observations, noise, settings.model)
    draws = settings.exact.draws
    seconds = [
        second_recording(base, flow_proposal(flow, base.recording), origin.seed, settings.effort, draws)
        for base in own
    ]
    changed = [replace(model, recording=second) for model, second in zip(models, seconds, strict=True)]
    rung = Rung(first, settings.exact, settings.effort, origin.seed)
    result = infer_structure(models, changed, rung, f"structure {posteriors.stem}")
    save(posteriors, to_groups(result), origin.provenance(KIND, settings))


class LadderStageSettings(Settings):
    """What tables and figure call things; ``labels`` by structure, in the order shown."""

    cohort_title: str
    interval: float
    survives_widths: float = Field(gt=0.0)
    labels: dict[str, str]


def ladder(
    *,
    structures: Sequence[Path],
    table: Path,
    pairs: Path,
    moves: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: LadderStageSettings,
    origin: Origin,
) -> None:
    """Write posteriors, evidence and probabilities of all structures, their average, and what moves.

    Args:
        structures: A file of each structure, named by it.
        table: Output, one row an answer, structure, subject and quantity.
        pairs: Output, one row a structure and pair (delta, tau).
        moves: Output, one row a quantity.
        figure_pdf: Output, evidence and moves.
        figure_png: Output, the same.

    Raises:
        ArtefactError: A file is no such artefact.
        ValueError: Structures have other subjects.
    """
    files = {path.stem: path for path in structures}
    results = {name: read_structure(files[name]) for name in settings.labels}
    frame = ladder_table(results, settings.labels, settings.interval, origin.seed)
    moved = moves_table(frame, settings.survives_widths)
    write_csv(table, frame)
    write_csv(pairs, pairs_table(results, settings.labels))
    write_csv(moves, moved)
    figure = draw_ladder(frame, settings.survives_widths, settings.cohort_title)
    save_figure(figure, figure_pdf, figure_png)
    survivors = ", ".join(moved.loc[moved["survives"] == 1, "quantity"]) or "none"
    LOGGER.info("moved by less than %g widths by every structure: %s", settings.survives_widths, survivors)
    LOGGER.info(ABOUT_PEOPLE)

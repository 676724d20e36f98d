"""Answering one subject outside the study: by which experiment, into which folder, what stays untouched."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, get_type_hints

from swesbi.artefacts import ArtefactError, folder_made_whole
from swesbi.config.new_recordings import is_free_running, noise_declared, quality_of
from swesbi.config.parts import named
from swesbi.config.read import ConfigError, add_options, in_words, merged_files, overlay, read_merged
from swesbi.config.refusals import context_refusal, network_of_pushes, trained_on, why_in_short
from swesbi.config.slices import stage_settings
from swesbi.config.study import Study, load_study
from swesbi.recording.clinical import ClinicalMeasures
from swesbi.study.finished import FinishedPopulation, FinishedStudy, answering_stage, finished_population
from swesbi.study.registry import file_arguments, stage_code, stage_function
from swesbi.study.stages.origin import Origin

OUTPUTS: Final = {
    "observation": "observation.h5",
    "shard": "simulations.h5",
    "posterior": "posterior.h5",
    "verdict": "verdict.json",
    "predictive": "predictive.h5",
    "ppc_png": "ppc.png",
    "posterior_png": "posterior.png",
    "sheet": "sheet.pdf",
}
FREE_OUTPUTS: Final = {name: file for name, file in OUTPUTS.items() if name != "shard"}
"""Of a free-running recording."""
REFERENCE: Final = {"passive_baseline": "passive.h5", "reference_fit": "cmaes.h5"}
"""Further outputs, where the reference fit is asked for."""
FREE_STAGES: Final = {True: "free_subject_of_population", False: "free_subject"}
"""Of a free-running recording: with the network of a population, and without."""
EXIT_REFUSED: Final = 2
"""Of a command that goes on where a subject, or a person, of a folder is refused."""
WITH_PRESSURES: Final = "with_pressures.h5"
"""A further output, of a subject of whom the pressures of a cuff were taken."""


class OtherAnswerError(ValueError):
    """A folder holds the answer to another recording, or something else; it is left as it is."""


def add_answering(parser: argparse.ArgumentParser, folder: str) -> None:
    """Add the options of every command that answers recordings outside the study.

    Args:
        parser: Of the command.
        folder: Where it puts its answer by default, for the help text.
    """
    parser.add_argument("--phases", type=int, help="gated phases of a recording; default: as configured")
    parser.add_argument(
        "--experiment",
        help="default: the first of kind speeds that runs, where it refuses a heart one over a population",
    )
    parser.add_argument("--out", type=Path, help=f"folder; default: {folder}")
    add_options(parser)


def study_with(options: argparse.Namespace, **new_subjects: object) -> Study:
    """Return the study with the cohort of the command's options as that of its new subjects.

    Args:
        options: Of the command.
        new_subjects: What else the options say of ``new_subjects``.

    Raises:
        ConfigError: The configuration, or the cohort, cannot be used.
    """
    raw = read_merged(options.config, options.overlay)
    chosen = dict(new_subjects)
    if options.phases is not None:
        chosen["phases"] = options.phases
    merged = overlay(raw, {"new_subjects": chosen})
    files = merged_files(options.config, options.overlay)
    return load_study(merged, in_words(options.config, options.overlay), options.cohort, files)


def experiments_to_ask(study: Study, asked: str | None) -> tuple[str, ...]:
    """Return the experiments that may answer, the first first: the one asked for, or all that run.

    Raises:
        ConfigError: The one asked for cannot answer, or none can.
    """
    able = {*study.config.speed_experiments, *study.config.population_experiments}
    if asked is not None:
        named(study, {"experiment": asked}, "experiment")
        if asked not in able:
            raise ConfigError(
                f"--experiment = {asked!r}: infers from features of the curve, and answers no recording "
                f"outside its own cohort; {' and '.join(name for name in _names(study) if name in able)} can"
            )
        return (asked,)
    if not study.answering_experiments:
        raise ConfigError(
            "run: no experiment of kind speeds or over a population runs, and no other answers a new subject"
        )
    return study.answering_experiments


def _names(study: Study) -> Sequence[str]:
    return (*study.config.experiments, *study.config.population_experiments)


def is_everyones(error: Exception) -> bool:
    """Tell whether an error is of the study, its network or the disk, and so of every subject of a folder."""
    from swesbi.study.stages.other_network import OtherNetworkError

    return isinstance(error, ArtefactError | OSError | OtherNetworkError)


def check_new_subject(study: Study, experiment: str, subject: str) -> None:
    """Refuse a subject that the cohort does not have or whose files are wrong, or that was trained on.

    Raises:
        ConfigError: Says which.
    """
    if subject in study.new_refused:
        raise ConfigError(study.new_refused[subject])
    if subject not in study.new_rows:
        known = ", ".join((*study.new_rows, *study.new_refused))
        raise ConfigError(f"subject = {subject!r}: {study.new_cohort} has {known}")
    if where := trained_on(study, experiment, subject):
        raise ConfigError(where)


def choose_experiment(study: Study, subject: str, experiments: Sequence[str]) -> tuple[str, str]:
    """Return the first experiment that can answer for a subject's heart, and what to say of those before it.

    Raises:
        ValueError: None can; lists why, and which other experiment could.
    """
    reasons: dict[str, str] = {}
    for experiment in experiments:
        check_new_subject(study, experiment, subject)
        if not (reason := context_refusal(study, experiment, subject)):
            return experiment, _instead(reasons, experiment)
        reasons[experiment] = reason
    others = [name for name in study.answering_experiments if name not in reasons]
    able = [name for name in others if not context_refusal(study, name, subject)]
    hint = f"\n`--experiment {able[0]}` can answer for this heart." if able else ""
    raise ValueError("\n".join(f"{name}: {reason}" for name, reason in reasons.items()) + hint)


def _instead(reasons: Mapping[str, str], experiment: str) -> str:
    if not reasons:
        return ""
    told = "; ".join(
        f"{name} does not know such a heart ({why_in_short(text)})" for name, text in reasons.items()
    )
    return f"{told}: {experiment}, trained over a population, answers instead"


def folder_of(study: Study, experiment: str, subject: str) -> Path:
    """Return where the answer to a subject outside the study lies."""
    return Path(study.config.results) / experiment / "new" / study.new_cohort_name / subject


def check_untouched(folder: Path, study: Study, subject: str) -> None:
    """Refuse to write over what is no answer, or the answer to another recording or heart.

    Raises:
        OtherAnswerError: Says what is there.
        RecordingError: The subject's own recording cannot be used.
        ArtefactError: What is there is damaged.
    """
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    kept = folder / OUTPUTS["observation"]
    remedy = "name another folder by --out, or write over it by --force"
    if not kept.is_file():
        raise OtherAnswerError(f"{folder}: is there already and holds no answer; {remedy}")
    same = _is_of_pushes if is_free_running(study, subject) else _is_of_samples
    if not same(kept, study, subject):
        raise OtherAnswerError(
            f"{folder}: holds the answer to another recording of {subject!r}, or its row of subjects.csv has "
            f"changed since; {remedy}"
        )


def _is_of_samples(kept: Path, study: Study, subject: str) -> bool:
    """Tell whether an observed curve is that of a subject's gated recording as it is now."""
    from swesbi.artefacts.files import hdf5_provenance
    from swesbi.recording.ingest import ingest
    from swesbi.recording.observation import KIND, read_observation, same_recording
    from swesbi.recording.reader import read_samples

    settings, layout = quality_of(study, subject), study.new_layout_of(subject)
    path, points = study.new_recording(subject), study.config.measurement.grid_points
    samples = read_samples(path, settings.phases, settings.density_kg_m3, layout, subject)
    context, clinical = study.new_rows[subject].to_context(), study.outside.clinical_of(subject).to_measures()
    now = ingest(samples, context, settings, points, clinical)
    return hdf5_provenance(kept).kind == KIND and same_recording(read_observation(kept), now)


def _is_of_pushes(kept: Path, study: Study, subject: str) -> bool:
    """Tell whether what is kept are the pushes of a subject's free-running recording as it is now."""
    from swesbi.artefacts.files import hdf5_provenance
    from swesbi.recording.free_observation import (
        KIND,
        ingest_free,
        read_free_observation,
        same_free_recording,
    )
    from swesbi.recording.free_samples import read_free_samples

    settings, layout = quality_of(study, subject), study.new_layout_of(subject)
    samples = read_free_samples(study.new_recording(subject), settings.density_kg_m3, layout, subject)
    context, clinical = study.new_rows[subject].to_context(), study.outside.clinical_of(subject).to_measures()
    now = ingest_free(samples, context, settings, noise_declared(study, subject), clinical)
    return hdf5_provenance(kept).kind == KIND and same_free_recording(read_free_observation(kept), now)


def answer_into(
    folder: Path,
    study: Study,
    subject: str,
    experiment: str,
    plain: Mapping[str, Any],
    finished: FinishedStudy | FinishedPopulation,
) -> None:
    """Answer a subject outside the pool, and put what is made into ``folder``, all of it or nothing.

    Args:
        folder: Output.
        study: The study.
        subject: Who is answered.
        experiment: By which experiment.
        plain: Settings of its stage.
        finished: What the experiment has left for it.

    Raises:
        ValueError: The recording cannot be used, or the network cannot answer for its context.
        ArtefactError: The folder cannot be written.
    """
    stage = answering_stage(study, experiment)
    # torch and matplotlib take seconds to import; what is refused above should not wait for them
    run = stage_function(stage)
    settings = get_type_hints(run)["settings"].from_plain(plain)
    # a refused subject leaves no folder behind
    with folder_made_whole(folder) as made:
        outputs = {name: made / file for name, file in OUTPUTS.items()}
        asked = REFERENCE if study.config.new_subjects.reference_fit else {}
        reference = {name: [made / asked[name]] if name in asked else [] for name in REFERENCE}
        further = [made / WITH_PRESSURES for _ in pressures_of(study, subject)]
        recorded = {"recording": study.new_recording(subject), "protocol": study.new_protocol}
        files = recorded | vars(finished) | outputs | reference | {"with_pressures": further}
        run(
            **file_arguments(run, files),
            settings=settings,
            origin=Origin(study.config.seed, subject, stage_code(stage)),
        )


def trained_for_pushes(study: Study, subject: str, experiments: Sequence[str]) -> tuple[str, str]:
    """Return the first experiment whose trained network takes a free-running recording, or none and why."""

    def untrained(name: str) -> str:
        trained = finished_population(Path(study.config.results), name).estimator.is_file()
        return "" if trained else f"the network of {name} has not been trained"

    return network_of_pushes(study, subject, experiments, untrained)


def answer_free_into(folder: Path, study: Study, subject: str, experiment: str, *, by_network: bool) -> None:
    """Answer a free-running recording, and put what is made into ``folder``, all of it or nothing.

    Args:
        folder: Output.
        study: The study.
        subject: Who is answered.
        experiment: Whose prior holds.
        by_network: Whether its network answers; else the prior is where the inference begins.

    Raises:
        ValueError: The recording cannot be used, or the network was trained under other settings.
        ArtefactError: The folder cannot be written.
    """
    stage = FREE_STAGES[by_network]
    plain = stage_settings(study, stage, experiment=experiment, subject=subject)
    run = stage_function(stage)
    settings = get_type_hints(run)["settings"].from_plain(plain)
    network = finished_population(Path(study.config.results), experiment).estimator
    with folder_made_whole(folder) as made:
        outputs = {name: made / file for name, file in FREE_OUTPUTS.items()}
        files = {"recording": study.new_recording(subject), "estimator": network} | outputs
        run(
            **file_arguments(run, files),
            settings=settings,
            origin=Origin(study.config.seed, subject, stage_code(stage)),
        )


def pressures_of(study: Study, subject: str) -> tuple[ClinicalMeasures, ...]:
    """Return the measures of a new subject, if the pressures of a cuff are among them."""
    clinical = study.outside.clinical_of(subject).to_measures()
    return (clinical,) if clinical.has_pressures else ()

"""Answer a subject outside the pool with the trained network: posterior, certificate, verdict, figures."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, get_type_hints

from swesbi.artefacts.atomic import make_command
from swesbi.config.parts import named
from swesbi.config.read import ConfigError, add_options, overlay, read_merged, snakemake_options
from swesbi.config.slices import stage_settings
from swesbi.config.study import Study, load_study
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.result import ExactResult
from swesbi.prior import ParameterPrior
from swesbi.recording.clinical import ClinicalMeasures
from swesbi.study.registry import file_arguments, stage_code, stage_function
from swesbi.study.stages.origin import Origin
from swesbi.verdict.answers import sampler_in_words, weights_in_words
from swesbi.verdict.support import Support

OUTPUTS: Final = {
    "observation": "observation.h5",
    "passive_baseline": "passive.h5",
    "reference_fit": "cmaes.h5",
    "shard": "simulations.h5",
    "posterior": "posterior.h5",
    "support": "support.json",
    "predictive": "predictive.h5",
    "ppc_png": "ppc.png",
    "posterior_png": "posterior.png",
}
WITH_PRESSURES: Final = "with_pressures.h5"
"""A further output, of a subject of whom the pressures of a cuff were taken."""
WIDTH = 18


@dataclass(frozen=True)
class FinishedStudy:
    """What a finished experiment on speeds leaves for subjects outside its pool.

    Attributes:
        estimator: The network.
        noise: Noise of the cohort.
        pooled_observations: Observed curves of the cohort.
        misspecifications: Null distributions of the cohort.
    """

    estimator: Path
    noise: Path
    pooled_observations: tuple[Path, ...]
    misspecifications: tuple[Path, ...]

    @property
    def files(self) -> tuple[Path, ...]:
        """All of them."""
        return (self.estimator, self.noise, *self.pooled_observations, *self.misspecifications)


@dataclass(frozen=True)
class FinishedPopulation:
    """What a finished experiment over a population leaves for subjects outside the study.

    Attributes:
        estimator: The network.
        noise: Noise of the study's cohort.
        null: Null recordings of the population.
    """

    estimator: Path
    noise: Path
    null: Path

    @property
    def files(self) -> tuple[Path, ...]:
        """All of them."""
        return (self.estimator, self.noise, self.null)


def finished_population(results: Path, experiment: str) -> FinishedPopulation:
    """Return where the study keeps what a population's network needs, by the workflow's rules."""
    inferred = results / experiment
    return FinishedPopulation(
        inferred / "estimator.pt", results / "cohort" / "noise.h5", inferred / "null.h5"
    )


def finished_study(results: Path, experiment: str, subjects: Sequence[str]) -> FinishedStudy:
    """Return where the study keeps what a new subject needs, by the names of the workflow's rules."""
    cohort, inferred = results / "cohort", results / experiment
    return FinishedStudy(
        estimator=inferred / "estimator.pt",
        noise=cohort / "noise.h5",
        pooled_observations=tuple(cohort / name / "observation.h5" for name in subjects),
        misspecifications=tuple(inferred / "subjects" / name / "misspecification.h5" for name in subjects),
    )


def finished_experiment(study: Study, experiment: str) -> FinishedStudy | FinishedPopulation:
    """Return what an experiment leaves for subjects outside its pool, on the cohort or over a population."""
    results = Path(study.config.results)
    if experiment in study.config.population_experiments:
        return finished_population(results, experiment)
    return finished_study(results, experiment, study.subjects_of(experiment))


def answering_stage(study: Study, experiment: str) -> str:
    """Return the stage by which an experiment answers a subject outside its pool."""
    over_population = experiment in study.config.population_experiments
    return "new_subject_of_population" if over_population else "new_subject"


def check_finished(study: FinishedStudy | FinishedPopulation, options: str = "") -> None:
    """Refuse a study that has not been run as far as it takes.

    Args:
        study: Its files.
        options: What Snakemake runs it with beside the targets (``--configfile tests/smoke.yaml``, say).

    Raises:
        FileNotFoundError: Names what is missing, and the command that makes it.
    """
    missing = [path for path in study.files if not path.is_file()]
    if missing:
        raise FileNotFoundError(
            f"{missing[0]} does not exist: the study that is to answer has not been run this far; run\n"
            f"  {make_command(missing, options)}"
        )


def answer_text(subject: str, result: ExactResult, support: Support, prior: Sequence[ParameterPrior]) -> str:
    """Return verdict, intervals and certificate in lines.

    Args:
        subject: Name.
        result: The exact posterior.
        support: The verdict.
        prior: Prior of each parameter of phi, whose bounds are printed beside the intervals.
    """
    doubt = "" if result.converged else "; NOT CONVERGED, do not use"
    mass = f"{100.0 * result.interval_mass:.0f} % interval"
    return "\n".join(
        [
            f"{subject}: {support.verdict}",
            *(f"  {reason}" for reason in support.reasons),
            f"{'':{WIDTH}}{'median':>8}  {mass:<18}  prior's bounds",
            *(_line(result, j, prior[j]) for j in range(len(PHI_NAMES))),
            f"certificate: draws by {sampler_in_words(support)}; weights: {weights_in_words(support)} "
            f"(k-hat at most {result.k_hat_limit:.2f}){doubt}",
        ]
    )


def pressures_text(clinical: ClinicalMeasures, result: ExactResult, prior: Sequence[ParameterPrior]) -> str:
    """Return the answer with pressures in lines; arguments as of :func:`answer_text`."""
    doubt = "" if result.converged else "; NOT CONVERGED, do not use"
    by = "MCMC" if result.by_mcmc else f"importance weights, efficiency {100.0 * result.efficiency:.0f} %"
    return "\n".join(
        [
            f"with cuff pressures {clinical.sbp_mmhg:g} / {clinical.dbp_mmhg:g} mmHg (by {by}{doubt}); the "
            "verdict is that of the speeds:",
            *(_line(result, j, prior[j]) for j in range(len(PHI_NAMES))),
        ]
    )


def _line(result: ExactResult, j: int, prior: ParameterPrior) -> str:
    low, median, high = median_and_interval(result.phi[:, j], result.interval_mass)
    interval = f"[{low:.4g}, {high:.4g}]"
    return f"{PHI_NAMES[j]:{WIDTH}}{median:8.4g}  {interval:<18}  {prior.low:g} to {prior.high:g}"


def main(arguments: Sequence[str]) -> int:
    """Run `new-subject`; return 0 after printing the answer.

    Raises:
        ConfigError: The configuration or the cohort is wrong, or does not have the subject.
        ValueError: The recording cannot be used, or the network cannot answer for the subject's context.
        OSError: The study has not been run, or the answer cannot be written.
    """
    options = _parser().parse_args(arguments)
    study = study_with(options)
    experiment = options.experiment or first_answering(study)
    subject: str = options.subject
    named(study, {"experiment": experiment}, "experiment")
    check_new_subject(study, experiment, subject)
    # an experiment that cannot answer is named before anything is looked for under its name
    plain = stage_settings(study, answering_stage(study, experiment), experiment=experiment, subject=subject)
    finished = finished_experiment(study, experiment)
    check_finished(finished, snakemake_options(options.config, options.overlay))
    folder = options.out or Path(study.config.results) / experiment / "new" / subject
    answer_into(folder, study, subject, experiment, plain, finished)
    print(_text(study, experiment, subject, folder))
    return 0


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
    """
    stage = answering_stage(study, experiment)
    # torch and matplotlib take seconds to import; what is refused above should not wait for them
    run = stage_function(stage)
    settings = get_type_hints(run)["settings"].from_plain(plain)
    # a refused subject leaves no folder behind
    existing = next(path for path in folder.absolute().parents if path.is_dir())
    with tempfile.TemporaryDirectory(prefix=f".{subject}-", dir=existing) as made:
        outputs = {name: Path(made) / file for name, file in OUTPUTS.items()}
        further = [Path(made) / WITH_PRESSURES for _ in _pressures(study, subject)]
        recorded = {"recording": study.new_recording(subject), "protocol": study.new_protocol}
        files = recorded | vars(finished) | outputs | {"with_pressures": further}
        run(
            **file_arguments(run, files),
            settings=settings,
            origin=Origin(study.config.seed, subject, stage_code(stage)),
        )
        folder.mkdir(parents=True, exist_ok=True)
        for path in (*outputs.values(), *further):
            path.replace(folder / path.name)


def _pressures(study: Study, subject: str) -> tuple[ClinicalMeasures, ...]:
    """Return the measures of a new subject, if the pressures of a cuff are among them."""
    clinical = study.outside.clinical_of(subject).to_measures()
    return (clinical,) if clinical.has_pressures else ()


def _text(study: Study, experiment: str, subject: str, folder: Path) -> str:
    from swesbi.posterior.result import read_exact_result
    from swesbi.verdict.support import read_support

    prior = study.config.speed_experiments[study.config.base_of(experiment)]
    bounds = (*study.config.priors[prior.prior].parameters, prior.passive_scale_kpa)
    result = read_exact_result(folder / OUTPUTS["posterior"])
    answer = [answer_text(subject, result, read_support(folder / OUTPUTS["support"]), bounds)]
    written = list(OUTPUTS.values())
    for clinical in _pressures(study, subject):
        answer.append(pressures_text(clinical, read_exact_result(folder / WITH_PRESSURES), bounds))
        written.append(WITH_PRESSURES)
    return "\n".join([*answer, f"written to {folder}: {', '.join(written)}"])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m swesbi new-subject",
        description="Answer a subject who is not in the study's cohort with the network that the study has "
        "trained: exact posterior with its certificate, verdict, figures, in seconds and without training. "
        "A subject whose heart is unlike those that it was trained on is refused, with the reason. The "
        "configuration is that of the study.",
    )
    parser.add_argument("--cohort", type=Path, required=True, help="folder with the subject's recording")
    parser.add_argument("--subject", required=True, help="which of its subjects")
    add_answering(parser, "<results>/<experiment>/new/<subject>")
    return parser


def add_answering(parser: argparse.ArgumentParser, folder: str) -> None:
    """Add the options of every command that answers recordings outside the study.

    Args:
        parser: Of the command.
        folder: Where it puts its answer by default, for the help text.
    """
    parser.add_argument("--phases", type=int, help="gated phases of a recording; default: as configured")
    parser.add_argument(
        "--experiment", help="default: the first of kind speeds that runs; or one over a population"
    )
    parser.add_argument("--out", type=Path, help=f"folder; default: {folder}")
    add_options(parser)


def study_with(options: argparse.Namespace) -> Study:
    """Return the study with the cohort of the command's options as that of its new subjects."""
    raw = read_merged(options.config, options.overlay)
    chosen: dict[str, object] = {"cohort": str(options.cohort)}
    if options.phases is not None:
        chosen["phases"] = options.phases
    return load_study(overlay(raw, {"new_subjects": chosen}), str(options.config))


def first_answering(study: Study) -> str:
    """Return the first experiment that runs and answers subjects outside the study.

    Raises:
        ConfigError: There is none.
    """
    running = [name for name in study.config.experiments_run if name in study.config.speed_experiments]
    running += study.config.populations_run
    if not running:
        raise ConfigError(
            "run: no experiment of kind speeds or over a population runs, and no other answers a new subject"
        )
    return running[0]


def check_new_subject(study: Study, experiment: str, subject: str) -> None:
    """Refuse a subject that the cohort does not have, or that the network was trained on.

    Raises:
        ConfigError: Says which.
    """
    cohort = Path(str(study.config.new_subjects.cohort))
    if subject not in study.new_rows:
        raise ConfigError(f"subject = {subject!r}: {cohort} has {', '.join(study.new_rows)}")
    if cohort.resolve() == study.cohort.resolve() and subject in study.subjects_of(experiment):
        raise ConfigError(
            f"subject = {subject!r}: is in the cohort that the network was trained on; its answer is in "
            f"{study.config.results}/<experiment>/subjects/{subject}/"
        )

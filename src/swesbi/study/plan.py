"""Say how many persons and repeats a study needs to find an effect, from simulated studies."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, get_type_hints

from swesbi.artefacts import Origin
from swesbi.artefacts.atomic import atomic_path
from swesbi.config.read import (
    ConfigError,
    at_configuration,
    in_words,
    merged_files,
    overlay,
    read_merged,
    snakemake_options,
)
from swesbi.config.slices import stage_settings
from swesbi.config.study import Study, load_study
from swesbi.persons.planning.asked import Effect, check_effect, parse_effect, parse_percent, parse_repeats
from swesbi.study.finished import check_finished, finished_experiment
from swesbi.study.registry import stage_code, stage_function

if TYPE_CHECKING:
    from swesbi.persons.planning.words import Planned

LOGGER = logging.getLogger("swesbi")
STAGE: Final = "plan_bank"
TABLE, TEXT = "plan.csv", "plan.txt"
FIGURES: Final = ("plan.pdf", "plan.png")


@dataclass(frozen=True)
class Asked:
    """What is planned, checked.

    Attributes:
        effect: To be found.
        design: ``paired`` or ``groups``.
        repeats: Numbers of repeats that are compared.
        noise: Standard deviation of one repeat's speed at a phase, as a fraction.
        power: Share of studies that are to find it.
        persons: Number for which power is reported besides; None: none.
    """

    effect: Effect
    design: str
    repeats: tuple[int, ...]
    noise: float
    power: float
    persons: int | None


def main(options: argparse.Namespace) -> int:
    """Run `plan`; return 0 after printing how many persons are needed, and what that assumes.

    Raises:
        ConfigError: The configuration is wrong.
        ValueError: What is asked for is no effect, or cannot be recorded or answered.
        OSError: The study has not been run, or the answer cannot be written.
    """
    options = at_configuration(options)
    raw = read_merged(options.config, options.overlay)
    if options.bank is not None:
        raw = overlay(raw, {"plan": {"persons": {"number": options.bank}}})
    files = merged_files(options.config, options.overlay)
    study = load_study(raw, in_words(options.config, options.overlay), files=files)
    asked = asked_for(options, study)
    experiment = options.experiment or study.config.plan.experiment
    if experiment not in study.config.population_experiments:
        known = ", ".join(study.config.population_experiments) or "none"
        raise ConfigError(
            f"--experiment {experiment!r}: simulated persons need a network of a population: {known}"
        )
    finished = finished_experiment(study, experiment)
    check_finished(finished, snakemake_options(options.config, options.overlay))
    folder = (
        options.out
        or Path(study.config.results) / experiment / "plan" / f"{asked.design}-{asked.effect.slug}"
    )
    banks = {
        repeats: _bank(study, experiment, asked, repeats, finished.estimator, options.processes)
        for repeats in asked.repeats
    }
    planned = _planned(study, experiment, asked, banks)
    print(_written(planned, folder))
    return 0


def asked_for(options: argparse.Namespace, study: Study) -> Asked:
    """Return what the options ask for.

    Raises:
        ValueError: It is no effect, or cannot be recorded or answered; names the option and its value.
    """
    config = study.config
    experiment = config.population_experiments.get(options.experiment or config.plan.experiment)
    effect = parse_effect(options.effect)
    if experiment is not None:
        check_effect(effect, config.priors[config.speed_experiments[experiment.base].prior])
    repeats = parse_repeats(options.repeats, config.recording.min_repeats_per_phase)
    noise = config.acquisition.repeat_sd_fraction
    if options.noise is not None:
        noise = parse_percent(options.noise, "--noise")
    if experiment is not None:
        for number in repeats:
            _check_noise(noise, number, study, experiment.conditions.relative_se)
    power = config.plan.power if options.power is None else parse_percent(options.power, "--power")
    if not 0.0 < power < 1.0:
        raise ValueError(f"--power {options.power!r}: a share of studies between 0 and 100%, without either")
    sizes = config.plan.studies.sizes
    if options.persons is not None and not sizes[0] <= options.persons <= sizes[-1]:
        raise ValueError(
            f"--persons {options.persons}: outside {sizes[0]} to {sizes[-1]}, plan.studies.sizes"
        )
    return Asked(effect, options.design, repeats, noise, power, options.persons)


def _check_noise(noise: float, repeats: int, study: Study, trained: tuple[float, float]) -> None:
    """Refuse recordings with other errors than the network has learnt from.

    Raises:
        ValueError: Says which standard error they would have.
    """
    if noise <= 0.0:
        raise ValueError(f"--noise {noise:g}: one repeat has an error; give a percentage above 0")
    made = study.config.acquisition
    factor = noise / made.repeat_sd_fraction
    samples = made.sample_sd_fraction**2 / made.samples_per_repeat
    error = factor * ((made.repeat_sd_fraction**2 + samples) / repeats) ** 0.5
    if not trained[0] <= error <= trained[1]:
        raise ValueError(
            f"{repeats} repeats with errors of {noise:.1%} leave a mean speed with a standard error of "
            f"{error:.1%}; the network has learnt from {trained[0]:.1%} to {trained[1]:.1%}: change --noise "
            "or --repeats, or conditions.relative_se of the experiment and train it anew"
        )


def _bank(study: Study, experiment: str, asked: Asked, repeats: int, estimator: Path, processes: int) -> Path:
    """Make the bank of a number of repeats, or go on with one that is there."""
    run, effect = stage_function(STAGE), asked.effect
    plain = stage_settings(
        study,
        STAGE,
        experiment=experiment,
        design=asked.design,
        parameter=effect.parameter,
        change=repr(effect.change),
        repeats=str(repeats),
        repeat_noise=repr(asked.noise),
    )
    name = f"{asked.design}-{effect.slug}-{repeats}x{100.0 * asked.noise:g}.h5"
    path = Path(study.config.results) / experiment / "plan" / "banks" / name
    files: dict[str, Any] = {"estimator": estimator, "bank": path}
    run(
        **files,
        settings=get_type_hints(run)["settings"].from_plain(plain),
        origin=Origin(study.config.seed, "", stage_code(STAGE)),
        processes=processes,
    )
    return path


def _planned(study: Study, experiment: str, asked: Asked, banks: Mapping[int, Path]) -> Planned:
    """Simulate the studies of every bank."""
    # scikit-learn and scipy take seconds to import; what is refused above should not wait for them
    from swesbi.persons.planning.bank import read_bank
    from swesbi.persons.planning.hyperdraws import Recycling, evaluate_bank
    from swesbi.persons.planning.luck import luck_of
    from swesbi.persons.planning.power import one_person_power, power_curve
    from swesbi.persons.planning.words import Planned

    config, plan = study.config, study.config.plan
    speeds = config.speed_experiments[config.base_of(experiment)]
    by = Recycling(config.priors[speeds.prior], config.cohort_posterior, config.change_groups)
    rule = (plan.probability, asked.power)
    curves, individuals = [], {}
    for repeats, path in banks.items():
        bank = read_bank(path)[0]
        found = evaluate_bank(bank, asked.design, plan.studies, by, config.seed)
        luck = luck_of(bank, asked.design, asked.effect, by)
        curves.append(power_curve(found, luck, asked.effect, repeats, plan.studies, rule, config.seed))
        individuals[repeats] = one_person_power(bank, asked.effect, config.changes.rule.probability)
    return Planned(
        effect=asked.effect,
        design=asked.design,
        power=asked.power,
        noise=asked.noise,
        persons=asked.persons,
        curves=tuple(curves),
        individuals=individuals,
        settings=plan,
        rule=(config.changes.rule.threshold, config.changes.rule.probability),
    )


def _written(planned: Planned, folder: Path) -> str:
    """Write table, text and figure; return what is printed."""
    from swesbi.artefacts.csv import write_csv
    from swesbi.persons.planning.words import plan_lines, plan_table
    from swesbi.report.figures.plan import draw_plan
    from swesbi.report.figures.style import save_figure

    text = "\n".join(plan_lines(planned))
    figure = draw_plan(planned)
    folder.mkdir(parents=True, exist_ok=True)
    write_csv(folder / TABLE, plan_table(planned))
    save_figure(figure, *(folder / name for name in FIGURES))
    with atomic_path(folder / TEXT) as temporary:
        temporary.write_text(f"{text}\n", encoding="utf-8")
    return f"{text}\nwritten to {folder}: {', '.join((TABLE, TEXT, *FIGURES))}"

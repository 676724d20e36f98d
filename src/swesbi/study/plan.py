"""Say how many persons and repeats a study needs to find an effect, from simulated studies."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts import Provenance
from swesbi.artefacts.csv import write_csv
from swesbi.artefacts.files import hdf5_provenance
from swesbi.artefacts.typed import TextFile
from swesbi.base.progress import LOGGER
from swesbi.config.read import ConfigError, at_configuration, snakemake_options
from swesbi.config.study import Study, study_of
from swesbi.config.view import View
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.persons.planning.effect import Effect, check_effect, parse_effect, parse_percent, parse_repeats
from swesbi.persons.planning.likelihoods import StudyAnalysis, likelihoods_of
from swesbi.persons.planning.power import Plan, one_person_power, plan_lines, plan_table, power_curve
from swesbi.persons.planning.simulation import Bank, BankSettings, answered_bank
from swesbi.study.results import check_network, experiment_files
from swesbi.study.stage import plain_settings, stage_code

CODE: Final = "swesbi.persons.planning.simulation:answered_bank"
TABLE, TEXT = "plan.csv", "plan.txt"
FIGURES: Final = ("plan.pdf", "plan.png")


@dataclass(frozen=True)
class PlanRequest:
    """What is planned, checked.

    The design is ``paired`` or ``groups``. Numbers of repeats are compared; noise is the standard deviation
    of one repeat's speed at a phase, as a fraction; power the share of studies that are to find the effect.
    Power is also reported for a number of ``persons``, if there is one.
    """

    effect: Effect
    design: str
    repeats: tuple[int, ...]
    noise: float
    power: float
    persons: int | None


def main(options: argparse.Namespace) -> int:
    """Run `plan`; return 0 after printing how many persons are needed, and what that assumes."""
    options = at_configuration(options)
    chosen = {} if options.bank is None else {"plan": {"persons": {"number": options.bank}}}
    study = study_of(options, chosen)
    experiment = options.experiment or study.config.plan.experiment
    asked = asked_for(options, study, experiment)
    finished = experiment_files(study, experiment)
    finished.check(snakemake_options(options.config, options.overlay))
    plans, banks = Path(study.config.results) / experiment / "plan", {}
    for repeats in asked.repeats:
        path = plans / "banks" / f"{asked.design}-{asked.effect.slug}-{repeats}x{100.0 * asked.noise:g}.h5"
        plain = bank_settings(study, experiment, asked, repeats)
        banks[repeats] = _bank(path, finished.network, plain, study.config.seed, options.processes)
    planned = _planned(study, experiment, asked, banks)
    print(_written(planned, options.out or plans / f"{asked.design}-{asked.effect.slug}"))
    return 0


def asked_for(options: argparse.Namespace, study: Study, experiment: str) -> PlanRequest:
    """Return what the options ask for."""
    config, populations = study.config, study.config.population_experiments
    if experiment not in populations:
        raise ConfigError(
            f"--experiment {experiment!r}: simulated persons need a network of a population: "
            f"{', '.join(populations) or 'none'}"
        )
    effect = parse_effect(options.effect)
    check_effect(effect, config.priors[config.speed_experiments[populations[experiment].base].prior])
    repeats = parse_repeats(options.repeats, config.recording.min_repeats_per_phase)
    made_with = config.acquisition.repeat_sd_fraction
    noise = made_with if options.noise is None else parse_percent(options.noise, "--noise")
    for number in repeats:
        _check_noise(noise, number, study, populations[experiment].conditions.relative_se)
    power = config.plan.power if options.power is None else parse_percent(options.power, "--power")
    if not 0.0 < power < 1.0:
        raise ValueError(f"--power {options.power!r}: a share of studies between 0 and 100%, without either")
    sizes = config.plan.studies.sizes
    if options.persons is not None and not sizes[0] <= options.persons <= sizes[-1]:
        raise ValueError(
            f"--persons {options.persons}: outside {sizes[0]} to {sizes[-1]}, plan.studies.sizes"
        )
    return PlanRequest(effect, options.design, repeats, noise, power, options.persons)


def _check_noise(noise: float, repeats: int, study: Study, trained: tuple[float, float]) -> None:
    """Refuse recordings with other errors than the network has learnt from."""
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


def bank_settings(study: Study, experiment: str, asked: PlanRequest, repeats: int) -> dict[str, Any]:
    """Return the plain settings of the bank of a number of repeats."""
    config, view = study.config, View(study, {"experiment": experiment})
    trained = plain_settings(experiment_files(study, experiment).trained_by, view)
    shared = ("model", "exact", "changes", "acquisition", "recording", "population")
    return view.together(*shared, "grid_points", "lvesv_fraction") | {
        "design": asked.design,
        "parameter": asked.effect.parameter,
        "change": asked.effect.change,
        "repeats": repeats,
        "repeat_noise": asked.noise,
        "persons": config.plan.persons.to_plain(),
        "train_population": trained,
    }


def _bank(path: Path, estimator: Path, plain: Mapping[str, Any], seed: int, processes: int) -> Bank:
    """Make the bank of a number of repeats, or go on with one that is there.

    It is written after every few persons, so that a run that is stopped goes on from there.
    """
    settings = BankSettings.from_plain(plain)
    check_network(estimator, settings.train_population)
    made = Provenance("", seed=seed, settings=settings.to_plain(), code_hash=stage_code(CODE))
    network, kept = TrainedFlow.read(estimator), kept_persons(path, made)
    for bank in answered_bank(network, kept, settings, seed=seed, processes=processes):
        bank.write(path, made)
    return Bank.read(path).before(settings.persons.number)


def kept_persons(path: Path, wanted: Provenance) -> Bank | None:
    """Return the bank that is there, if it was made under these settings and by this code; else None."""
    if not path.is_file():
        return None
    found, persons = hdf5_provenance(path), wanted.settings["persons"]
    there = dict(found.settings)
    there["persons"] = {**there.get("persons", {}), "number": persons["number"]}
    if (there, found.code_hash, found.seed) != (dict(wanted.settings), wanted.code_hash, wanted.seed):
        LOGGER.info("%s was made under other settings or by other code, and is made anew", path)
        return None
    return Bank.read(path)


def _planned(study: Study, experiment: str, asked: PlanRequest, banks: Mapping[int, Bank]) -> Plan:
    """Simulate the studies of every bank."""
    config, plan = study.config, study.config.plan
    speeds = config.speed_experiments[config.base_of(experiment)]
    by = StudyAnalysis(config.priors[speeds.prior], config.cohort_posterior, config.change_groups)
    rule = (plan.probability, asked.power)
    curves, individuals = [], {}
    for repeats, bank in banks.items():
        found = likelihoods_of(bank, asked.design, asked.effect, by)
        curves.append(power_curve(found, repeats, plan.studies, rule, config.seed))
        individuals[repeats] = one_person_power(bank, asked.effect, config.changes.rule.probability)
    return Plan(
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


def _written(planned: Plan, folder: Path) -> str:
    """Write table, text and figure; return what is printed."""
    # matplotlib takes a second to import; what is refused above should not wait for it
    from swesbi.report.figures.change import draw_plan
    from swesbi.report.figures.style import save_figure

    text = "\n".join(plan_lines(planned))
    figure = draw_plan(planned)
    folder.mkdir(parents=True, exist_ok=True)
    write_csv(folder / TABLE, plan_table(planned))
    save_figure(figure, *(folder / name for name in FIGURES))
    TextFile().write(f"{text}\n", folder / TEXT)
    return f"{text}\nwritten to {folder}: {', '.join((TABLE, TEXT, *FIGURES))}"

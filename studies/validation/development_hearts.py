"""What hearts of development ask for that are further from the model than those of studies/discrepancy.

    python -m studies.validation.development_hearts --csv docs/tables/development_hearts.csv

Hearts of the stream of development (studies/validation/README.md), none of the validation, are recorded and
inferred by adaptive importance sampling, no network in between: 40 of generator b, whose physiology is drawn
from ranges twice as wide in log as those of the discrepancy, 60 of y, whose passive stiffness rises in
compression as in stretch, and 24 of z, which have another structure (thin wall, second Piola stress, proximal
twice as wide in log as those of studies/discrepancy, 60 of y, whose passive stiffness rises in compression
capacitance). Each is inferred with the nuisance parameters free, as configured; with one exponent of the
passive stiffness; with widths of 1 and 2 of the prior of its factor in compression; and with all nuisances
fixed at the settings of the forward model. Prints for each pair (delta, tau) the total log evidence and how
often the true parameters lie in their credible intervals. Takes half an hour on one core.
"""

from __future__ import annotations

import argparse
import logging
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pandas as pd

from studies.discrepancy.evidence import PairScore, discrepancy_table, score_subject
from studies.discrepancy.settings import DiscrepancyStudySettings
from studies.validation.passive_beat import study_settings, with_known_physiology
from swesbi.base.progress import Progress
from swesbi.config.models import Config
from swesbi.config.read import parse_config, read_merged
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.parameters import OPERATOR
from swesbi.prior import ParameterPrior
from swesbi.recording.speed import NoiseComponents
from swesbi.report.csv import write_csv
from swesbi.seeds import generator as stream_of
from swesbi.virtual.generated import GeneratedSubject
from swesbi.virtual.hearts.generators import all_generators, generator_of
from swesbi.virtual.hearts.heart import Generator
from swesbi.virtual.hearts.recorded import record_heart

STREAM: Final = "development"
POPULATION: Final = "amortised"
HEARTS: Final = {"b": 40, "y": 60, "z": 24}
SPEED_FRACTIONS: Final = (0.0, 0.01, 0.02)
TIMING_CYCLES: Final = (0.0, 0.005, 0.01, 0.015)
COMPRESSION: Final = "passive_compression_factor"


def main() -> None:
    """Infer the hearts of every generator in every way, and print and write what each pair comes to."""
    arguments = _arguments()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    settings, seed = study_settings(arguments.config)
    config = parse_config(read_merged(arguments.config))
    study = settings.study.model_copy(
        update={"speed_fractions": SPEED_FRACTIONS, "timing_cycles": TIMING_CYCLES}
    )
    frames = []
    for letter, number in HEARTS.items():
        hearts = development_hearts(config, letter, arguments.hearts or number)
        frames += [
            table(letter, nuisances, hearts, model, study, seed)
            for nuisances, model in inferences(settings.model).items()
        ]
    frame = pd.concat(frames, ignore_index=True)
    print(frame.to_string(index=False, float_format="%.4g"))
    if arguments.csv:
        write_csv(arguments.csv, frame)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--hearts", type=int, help="how many of each generator; 40, 60 and 24, if not given")
    parser.add_argument("--csv", type=Path, help="table to write, a row a generator, inference and pair")
    return parser.parse_args()


def inferences(model: SpeedModelSettings) -> dict[str, SpeedModelSettings]:
    """Return the models by name: the one given, others of the passive law, and with physiology known."""
    prior = model.prior.theta.nuisances.passive_compression_factor
    assert prior is not None, "config.yaml frees it"
    widths = {f"compression {log_sd:g}": prior.model_copy(update=_width(log_sd)) for log_sd in (1.0, 2.0)}
    laws: dict[str, ParameterPrior | None] = {"one exponent": None, **widths}
    return {
        "free": model,
        **{name: _with_compression(model, prior) for name, prior in laws.items()},
        "fixed": with_known_physiology(model),
    }


def _width(log_sd: float) -> dict[str, float]:
    """Return the width of a prior about 1, and bounds at four standard deviations or the declared range."""
    low, high = next(each for each in OPERATOR if each.name == COMPRESSION).declared
    reach = math.exp(4.0 * log_sd)
    return {"log_sd": log_sd, "low": max(1.0 / reach, low), "high": min(reach, high)}


def _with_compression(model: SpeedModelSettings, prior: ParameterPrior | None) -> SpeedModelSettings:
    theta = model.prior.theta
    theta = theta.model_copy(update={"nuisances": theta.nuisances.model_copy(update={COMPRESSION: prior})})
    return model.model_copy(update={"prior": model.prior.model_copy(update={"theta": theta})})


def development_hearts(config: Config, letter: str, number: int) -> list[GeneratedSubject]:
    """Record the first hearts of a generator in the stream of development.

    Standard errors are told from the noise that the recordings were made with.

    Raises:
        RuntimeError: A heart could not be recorded.
        ValueError: There is no such generator, or its law has another theta.
    """
    made_by = generator_of(_generators(config), letter)
    noise = NoiseComponents(
        made_by.acquisition.repeat_sd_fraction,
        made_by.acquisition.sample_sd_fraction,
        made_by.acquisition.sweep_fraction,
    )
    return [_recorded(made_by, index, noise, config) for index in range(number)]


def _generators(config: Config) -> dict[str, Generator]:
    population = config.population_experiments[POPULATION]
    base = config.speed_experiments[population.base]
    prior, measured = config.priors[base.prior], base.misspecification.rule.volumes.lvesv_tolerance_fraction
    made = all_generators(population.population, prior, config.acquisition, measured)
    return dict(made)


def _recorded(made_by: Generator, index: int, noise: NoiseComponents, config: Config) -> GeneratedSubject:
    grid_points = config.measurement.grid_points
    recorded = record_heart(made_by, index, config.seed, STREAM, config.recording, grid_points)
    theta = recorded.heart.theta
    if theta is None:
        raise ValueError(f"generator {made_by.letter}: its law has another theta, so none can be covered")
    return GeneratedSubject(measured_speeds(recorded.observation, noise), theta)


def table(
    letter: str,
    nuisances: str,
    hearts: Sequence[GeneratedSubject],
    model: SpeedModelSettings,
    study: DiscrepancyStudySettings,
    seed: int,
) -> pd.DataFrame:
    """Return a row a pair, as ``discrepancy_table`` has it, of one generator and one inference."""
    progress = Progress(f"hearts of {letter}, nuisances {nuisances}", len(hearts), unit="heart")
    scores: list[tuple[PairScore, ...]] = []
    for index, heart in enumerate(hearts):
        rng = stream_of(seed, "development hearts", letter, nuisances, index)
        scores.append(score_subject(heart, model, study, rng))
        progress.step()
    phases = [len(heart.recording.phase) for heart in hearts]
    frame = discrepancy_table(study.pairs, scores, phases, study.interval)
    frame.insert(0, "generator", letter)
    frame.insert(1, "nuisances", nuisances)
    return frame


if __name__ == "__main__":
    main()

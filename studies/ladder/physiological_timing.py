"""Search the setting of the forward model with physiological timing, and print it and what it reaches.

python -m studies.ladder.physiological_timing          # the search, two runs of four minutes on a free core
python -m studies.ladder.physiological_timing --judge  # what the setting in config.yaml reaches, in seconds

Contexts are those of the shipped cohort and of twelve healthy adults of the population; theta is the centre
of the prior. The values go to `ladder.structures.physiological_timing` of config.yaml beside this file.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import Final

import numpy as np

from studies.ladder.ejection import holds_published, prior_predictive_lvet_ms
from studies.ladder.settings import LadderSettings
from studies.ladder.timing import (
    SEARCHED,
    TimingSearch,
    moved_nuisances,
    rounded,
    search_timing,
    timing_loss,
    timing_table,
)
from swesbi.config.models import Config
from swesbi.config.read import parse_config, parse_section, read_merged, read_yaml
from swesbi.config.study import Study
from swesbi.context import Context
from swesbi.heart.settings import ForwardModelSettings
from swesbi.population.contexts import draw_population
from swesbi.prior import log_centre
from swesbi.recording.cohort.subjects import read_subjects

HERE: Final = Path(__file__).parent
ROOT: Final = HERE.parents[1]
ADULTS: Final = 12
GROUP: Final = "adults"
COHORT: Final = ROOT / "data" / "virtual_volunteers" / "subjects.csv"
DRAWS: Final = 100
STRUCTURE: Final = "physiological_timing"


def healthy_adults(config: Config, wanted: int) -> tuple[Context, ...]:
    """Draw the first healthy adults of the population over which `amortised` is trained."""
    population = config.population_experiments["amortised"].population
    found: list[Context] = []
    for number in count():
        drawn = draw_population([number], population, config.seed, "physiological timing")[0]
        if drawn.group == GROUP:
            found.append(drawn.context)
        if len(found) == wanted:
            return tuple(found)
    raise RuntimeError("no number is left")


def configured(config: Config) -> Config:
    """Return the study's configuration changed to the structure as the ladder's has it."""
    ladder = parse_section(read_yaml(HERE / "config.yaml")["ladder"], "ladder", LadderSettings)
    changes = ladder.structures[STRUCTURE].changes
    return Study(config, {}).with_changes(changes, "config.yaml").config


def report(theta: np.ndarray, contexts: tuple[Context, ...], settings: ForwardModelSettings) -> None:
    """Print the parameters of a setting and what it reaches."""
    for name in SEARCHED:
        print(f"{name:32s} {getattr(settings, name):.3g}")
    print(f"loss {timing_loss(theta, contexts, settings):.5f} (0: every range reached in every context)")
    print(timing_table(theta, contexts, settings).to_string(index=False, float_format=lambda x: f"{x:.4g}"))


def report_ejection(config: Config, contexts: Sequence[Context], name: str) -> None:
    """Print the ejection times of the prior predictive, and whether they hold the published ones."""
    prior = config.priors["calibrated"]
    lvet_ms = prior_predictive_lvet_ms(contexts, prior, config.forward_model, DRAWS, config.seed)
    low, median, high = np.nanquantile(lvet_ms, (0.05, 0.5, 0.95))
    words = "as" if holds_published(lvet_ms) else "not as"
    print(f"LVET, prior predictive, {name}: {median:.0f} ms ({low:.0f} to {high:.0f}), {words} published")


def main() -> None:
    """Search or judge, and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--judge", action="store_true", help="the setting in config.yaml, without a search")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2], help="a run of CMA-ES for each")
    parser.add_argument("--generations", type=int, default=250, help="of each run")
    arguments = parser.parse_args()
    config = parse_config(read_merged(ROOT / "config.yaml"))
    contexts = (*read_subjects(COHORT), *healthy_adults(config, ADULTS))
    theta = log_centre(config.priors["paper"])
    if arguments.judge:
        report(theta, contexts, configured(config).forward_model)
        report_ejection(config, contexts, "as shipped")
        report_ejection(configured(config), contexts, "this setting")
        return
    print("as shipped")
    report(theta, contexts, config.forward_model)
    begin = time.perf_counter()
    search = TimingSearch(seeds=tuple(arguments.seeds), generations=arguments.generations)
    fit = search_timing(theta, contexts, config.forward_model, search)
    print(f"\nfound in {time.perf_counter() - begin:.0f} s by {fit.simulations} simulations")
    found = rounded(fit.settings)
    report(theta, contexts, found)
    print("\nnuisance parameters that move with it")
    for name, values in moved_nuisances(found, config.priors["calibrated"].nuisances).items():
        print(f"{name}: {{ {', '.join(f'{key}: {value:g}' for key, value in values.items())} }}")


if __name__ == "__main__":
    main()

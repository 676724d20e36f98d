"""Say whether natural waves are interpreted: the model's speeds at valve closure beside those of people."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from swesbi.config.natural_waves import closures_under
from swesbi.config.read import add_options, in_words, parsed, read_merged
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study
from swesbi.recording.check import aligned
from swesbi.verdict.answers import NOT_INTERPRETABLE

if TYPE_CHECKING:
    from swesbi.verdict.closure_speeds import ClosureSpeeds

HEADER: Final = (
    "event",
    "model's {mass:.0f} % (m/s)",
    "median",
    "volunteers",
    "mean",
    "sd",
    "within",
    "source",
)


def main(arguments: Sequence[str]) -> int:
    """Run `closures`; return 0 after printing a row for each published speed, and the outcome of the rule.

    Raises:
        ConfigError: The configuration is wrong, or the experiment has no likelihood of speeds.
    """
    options = parsed(_parser(), arguments)
    config, changes = options.config, options.overlay
    study = load_study(read_merged(config, changes), in_words(config, changes))
    experiment = options.experiment or next(iter(study.config.speed_experiments))
    model = stage_settings(study, "exact_posterior", experiment=experiment)["model"]
    outcome = closures_under(study.config, model)
    header = [name.format(mass=100.0 * study.config.natural_waves.central_mass) for name in HEADER]
    print("\n".join(aligned([header, *_rows(outcome)])))
    for one in outcome:
        print(f"{one.event}: {'interpreted' if one.interpretable else NOT_INTERPRETABLE}")
    return 0


def _rows(outcome: Sequence[ClosureSpeeds]) -> list[tuple[str, ...]]:
    """Return a row for each published speed."""
    return [
        (
            one.event,
            f"{one.low:.2f} to {one.high:.2f}",
            f"{one.median:.2f}",
            str(known.volunteers),
            f"{known.mean_m_s:.2f}",
            f"{known.sd_m_s:.2f}",
            "no" if known in one.missed else "yes",
            known.source,
        )
        for one in outcome
        for known in one.published
    ]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="swesbi closures",
        description="Draw the speeds of natural waves at the closures of both valves from the prior "
        "predictive of healthy hearts, and hold them against what was measured in healthy volunteers. Waves "
        "of an event are interpreted where the central mass of the prediction holds every published mean. "
        "The rule and the sources are `natural_waves` in config.yaml; every answer to natural waves applies "
        "it.",
    )
    parser.add_argument("--experiment", help="whose prior; default: the first of kind speeds")
    add_options(parser)
    return parser

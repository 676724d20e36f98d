"""List the stages of the study by phase, or run one of them without Snakemake."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, get_type_hints

from swesbi.artefacts import Origin
from swesbi.config.parts import NUMBERED, option_of
from swesbi.config.read import at_configuration, in_words, merged_files, read_merged
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study
from swesbi.study import parsers
from swesbi.study.registry import (
    STAGES,
    file_arguments,
    file_types,
    stage_code,
    stage_function,
)

WHICH: Final = "which "  # before the name of a wildcard among the parsed options
WILDCARDS: Final = ("subject", "experiment", "prior", "generator", *NUMBERED)


def main(options: argparse.Namespace) -> int:
    """Run `stages`: list them, or run the one that is named; return the exit code.

    Raises:
        ConfigError: The configuration is wrong, or the stage needs a wildcard that is not given.
        ValueError, OSError: As the stage.
    """
    if options.stage is not None:
        return _run_stage(options.stage, options.options)
    parsers.stages().print_help()
    return 0


def _run_stage(name: str, given: Sequence[str]) -> int:
    run = stage_function(name)
    options = vars(at_configuration(_parser(name, run).parse_args(given)))
    config, changes = options.pop("config"), options.pop("overlay")
    study = load_study(
        read_merged(config, changes), in_words(config, changes), files=merged_files(config, changes)
    )
    chosen = {name: options.pop(WHICH + name) for name in WILDCARDS}
    wildcards = {name: value for name, value in chosen.items() if value is not None}
    settings = get_type_hints(run)["settings"].from_plain(stage_settings(study, name, **wildcards))
    origin = Origin(study.config.seed, wildcards.get("subject", ""), stage_code(name))
    run(**file_arguments(run, options), settings=settings, origin=origin)
    return 0


def _parser(name: str, run: Callable[..., None]) -> argparse.ArgumentParser:
    """Build a stage's parser: an option for every file of its function, and what chooses its settings."""
    parser = argparse.ArgumentParser(prog=f"swesbi stages {name}", description=STAGES[name])
    parsers.add_options(parser)
    parameters = inspect.signature(run).parameters
    for wildcard in WILDCARDS:
        which = f"which {wildcard}, where the stage has several"
        kind = "NUMBER" if wildcard in NUMBERED else "NAME"
        parser.add_argument(option_of(wildcard), dest=WHICH + wildcard, metavar=kind, help=which)
    for key, hint in file_types(run).items():
        default = parameters[key].default if key in parameters else inspect.Parameter.empty
        parser.add_argument(f"--{key.replace('_', '-')}", **_option(hint, default))
    return parser


def _option(hint: object, default: object) -> dict[str, Any]:
    if default is not inspect.Parameter.empty:
        return {"default": default, "type": type(default), "help": f"default: {default}"}
    several = hint is not Path
    return {
        "type": Path,
        "required": True,
        "nargs": "*" if several else None,
        "help": "files, or none" if several else "file",
    }

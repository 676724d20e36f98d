"""The command line: every stage of the study without Snakemake, and commands around a cohort."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import inspect
import logging
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, get_type_hints

from swesbi.artefacts import Origin
from swesbi.artefacts.atomic import write_fault
from swesbi.config.parts import NUMBERED, option_of
from swesbi.config.read import ConfigError, add_options, in_words, merged_files, parsed, read_merged
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study
from swesbi.study.registry import STAGES, file_arguments, file_types, stage_code, stage_function

EXIT_USAGE = 2
EXIT_INTERRUPTED = 130  # as shells have it of SIGINT
WHICH = "which "  # before the name of a wildcard among the parsed options
WILDCARDS = ("subject", "experiment", "prior", "generator", *NUMBERED)
COMMANDS = {
    "demo": "swesbi.study.demo",
    "validate": "swesbi.study.validate",
    "template": "swesbi.recording.template",
    "infer": "swesbi.study.infer",
    "compare": "swesbi.study.compare",
    "plan": "swesbi.study.plan",
    "inspect": "swesbi.study.inspect.command",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code: 0, or 2 with one message for input that cannot be used."""
    if sys.platform == "win32":  # which has no fork, no file locks of this kind, and no harmless os.kill
        print("swesbi: needs Linux; on Windows, install it in WSL", file=sys.stderr)
        return EXIT_USAGE
    os.environ["MPLBACKEND"] = "agg"  # that of the caller's shell may be one that is not installed here
    logging.basicConfig(format="%(message)s")
    logging.getLogger("swesbi").setLevel(logging.INFO)
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        # a command that reads a configuration goes to its folder
        with contextlib.chdir(Path.cwd()):
            return _run(given)
    except (ConfigError, ValueError, OSError) as error:
        print(f"swesbi: {_message(error)}", file=sys.stderr)
        return EXIT_USAGE
    except KeyboardInterrupt:
        print("\nswesbi: interrupted; of what was being made nothing is left behind", file=sys.stderr)
        return EXIT_INTERRUPTED


def _run(given: Sequence[str]) -> int:
    if given and given[0] in COMMANDS:
        return int(importlib.import_module(COMMANDS[given[0]]).main(given[1:]))
    return _run_stage(given[0], given[1:]) if given and given[0] in STAGES else _overview(given)


def _message(error: ValueError | OSError) -> str:
    """Return what is wrong; of what the system refuses to write also what to do."""
    reason = write_fault(error) if isinstance(error, OSError) else None
    return f"{getattr(error, 'filename', None)}: cannot be written, {reason}" if reason else str(error)


def _overview(given: Sequence[str]) -> int:
    """Show the lists of commands and stages; anything but a call for help is a mistake."""
    parser = argparse.ArgumentParser(
        prog="swesbi",
        description="Commands around a cohort, and the stages of the study, one at a time.\n"
        "`snakemake --cores 2` runs all stages; `swesbi NAME --help` says what each needs.",
    )
    commands = {name: _summary(module) for name, module in COMMANDS.items()}
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = f"commands:\n{_listing(commands)}\n\nstages:\n{_listing(STAGES)}"
    parser.add_argument("name", choices=[*COMMANDS, *STAGES], metavar="NAME", help="one of those below")
    parser.parse_args(given)
    return 0


def _listing(lines: Mapping[str, str]) -> str:
    width = max(map(len, STAGES)) + 2
    return "\n".join(f"  {name:<{width}}{line}" for name, line in lines.items())


def _summary(module: str) -> str:
    """Return the first line of a module's docstring, without importing it."""
    path = Path(__file__).parent.joinpath(*module.split(".")[1:]).with_suffix(".py")
    return path.read_text(encoding="utf-8").split('"""')[1].splitlines()[0]


def _run_stage(name: str, given: Sequence[str]) -> int:
    run = stage_function(name)
    options = vars(parsed(_parser(name, run), given))
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
    parser = argparse.ArgumentParser(prog=f"swesbi {name}", description=STAGES[name])
    add_options(parser)
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


if __name__ == "__main__":
    sys.exit(main())

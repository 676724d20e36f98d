"""The command line: commands around recordings, and around finished studies.

A command's options are parsed before its module is imported, which takes seconds.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import gc
import importlib
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from swesbi import __version__
from swesbi.base.environment import missing, of_another_folder
from swesbi.base.terminal import (
    EXIT_REFUSED,
    EXIT_UNREAD,
    InterruptedBySignal,
    ended_by_signals,
    print_to_nobody,
    terminal,
)


class Command(NamedTuple):
    """A command: the module that runs it, what it does and an example."""

    module: str
    purpose: str
    example: str


COMMANDS: Final = {
    "demo": Command(
        "swesbi.study.demo",
        "Infer one shipped recording of known parameters: posterior, verdict, figure, PDF sheet.",
        "swesbi demo",
    ),
    "template": Command(
        "swesbi.recording.cohort.template",
        "Write an empty folder for your recordings, or propose a mapping for a table of another tool.",
        "swesbi template data/my_cohort",
    ),
    "validate": Command(
        "swesbi.study.validate",
        "Check a folder of recordings: list every problem, or summarise what each recording contains.",
        "swesbi validate data/my_cohort --plot sheets",
    ),
    "infer": Command(
        "swesbi.study.infer",
        "Infer one recording or a folder: posterior, diagnostics, verdict, figures and tables.",
        "swesbi infer data/my_cohort --workers 2",
    ),
    "compare": Command(
        "swesbi.study.compare",
        "Infer what has changed between two visits of a person, or of all persons of a folder.",
        "swesbi compare --cohort data/virtual_trial --person P01",
    ),
    "plan": Command(
        "swesbi.study.plan",
        "Estimate from simulated studies how many persons and repeats an effect needs.",
        "swesbi plan --effect k_sr=-20% --repeats 3,5",
    ),
    "inspect": Command(
        "swesbi.study.inspect",
        "Summarise result files, or verify their checksums.",
        "swesbi inspect --check results",
    ),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code: 0, or 2 with one message for input that cannot be used."""
    if sys.platform == "win32":  # which has no fork, no file locks of this kind, and no harmless os.kill
        print("swesbi: needs Linux; on Windows, install it in WSL", file=sys.stderr)
        return EXIT_REFUSED
    if renew := of_another_folder():
        print(f"swesbi: {renew}", file=sys.stderr)
        return EXIT_REFUSED
    with contextlib.redirect_stdout(terminal(sys.stdout)), contextlib.redirect_stderr(terminal(sys.stderr)):
        return _guarded(list(sys.argv[1:] if arguments is None else arguments))


def _guarded(given: Sequence[str]) -> int:
    """Run one command, and say in one message why it cannot go on."""
    os.environ["MPLBACKEND"] = "agg"  # that of the caller's shell may be one that is not installed here
    # sums split over threads differ in the last bits, and of small matrices they take longer
    os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    logging.basicConfig(format="%(message)s")
    logging.getLogger("swesbi").setLevel(logging.INFO)
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # a home that it cannot write, say
    try:
        # a command that reads a configuration goes to its folder
        with ended_by_signals(), contextlib.chdir(Path.cwd()):
            try:
                return _run(given)
            finally:
                sys.stdout.flush()
    except BrokenPipeError:
        print_to_nobody()
        return EXIT_UNREAD
    except (ValueError, OSError, MemoryError) as error:
        print(f"swesbi: {_message(error)}", file=sys.stderr)
        if isinstance(error, OSError) and error.errno == errno.ENOSPC and error.filename is None:
            print_to_nobody()  # it was the printing that failed
        return EXIT_REFUSED
    except ModuleNotFoundError as error:
        if (named := missing(error)) is error:
            raise
        print(f"swesbi: {named}", file=sys.stderr)
        return EXIT_REFUSED
    except InterruptedBySignal as signal:
        print("\nswesbi: interrupted; of what was being made nothing is left behind", file=sys.stderr)
        return signal.exit_code


def _run(given: Sequence[str]) -> int:
    if given and given[0] in COMMANDS:
        from swesbi.study import parsers  # which takes a moment, in which Ctrl-C is no traceback

        command = COMMANDS[given[0]]
        options = getattr(parsers, given[0])().parse_args(given[1:])
        module = importlib.import_module(command.module)
        gc.freeze()  # what was imported stays: to search it for garbage takes a tenth of an answer's time
        return int(module.main(options))
    parser = argparse.ArgumentParser(
        prog="swesbi",
        description="Posteriors of contraction and relaxation from shear wave elastography of the heart.",
        epilog="\n".join(
            f"{name}\n  {command.purpose}\n  example: {command.example}" for name, command in COMMANDS.items()
        ),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"swesbi {__version__}")
    parser.add_argument(
        "command",
        choices=COMMANDS,
        metavar="COMMAND",
        help="one of those below; `swesbi COMMAND --help` lists its options",
    )
    parser.parse_args(given)
    return 0


def _message(error: ValueError | OSError | MemoryError) -> str:
    """Return what is wrong; of what the system refuses to write also what to do."""
    if isinstance(error, MemoryError):
        return f"the memory ran out {error}".strip()
    from swesbi.artefacts.atomic import write_fault

    if not isinstance(error, OSError) or (reason := write_fault(error)) is None:
        return str(error)
    return f"{error.filename or 'what is printed'}: cannot be written, {reason}"


if __name__ == "__main__":
    sys.exit(main())

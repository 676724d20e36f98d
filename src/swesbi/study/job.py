"""Running one stage as one job of the workflow: arguments by name, a log with tracebacks, short errors."""

from __future__ import annotations

import contextlib
import inspect
import logging
import os
import resource
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol, TextIO, get_type_hints

from swesbi.artefacts import DamagedArtefactError, Origin
from swesbi.artefacts.atomic import write_fault
from swesbi.base.processes import exit_when_gone
from swesbi.base.progress import Progress
from swesbi.base.terminal import terminal
from swesbi.study.registry import file_arguments, file_types, stage_function
from swesbi.study.running import RUN

LOGGER = logging.getLogger("swesbi")
EXIT_FAILURE = 1
START_UP = "start-up: "
"""Begins the line of a log that says what came before the stage, in seconds of processor time."""
RUN_WITH = "run with: "
"""Begins the line that gives what Snakemake was given beside its targets."""
SERVED = "runs of the stage: "
"""Begins the line that says how many runs of the stage the job serves: one for each of its subjects."""
MEMBERS = "members"
PROCESSOR_TIME = "processor time: "
"""Begins the line that says what the whole job took, with the processes that it started."""
WALL_TIME = "wall time: "
MEMORY = "peak memory: "


class SnakemakeJob(Protocol):
    """What this module uses of the ``snakemake`` object that a script finds."""

    input: Any
    output: Any
    params: Any
    config: Any
    log: Any


def run_job(snakemake: SnakemakeJob) -> None:
    """Run the stage of one Snakemake job.

    The rule's named inputs and outputs become the arguments of the same names; ``params.stage`` holds the
    stage's name, settings, seed, subject and code hash. A job that serves several holds as much for each of
    its ``members`` and numbers its files as they are; the stage runs for one after the other. A resource of
    the configuration goes to a stage that has an argument of its name; it must not change a result. The job
    ends when the run that started it is gone.

    Raises:
        SystemExit: The stage failed; the traceback is in the rule's log, the message on the terminal.
    """
    began = time.monotonic() - time.process_time()  # nothing waits before this
    os.environ["MPLBACKEND"] = "agg"  # that of the caller's shell may be one that is not installed here
    stage = snakemake.params["stage"]
    run = stage_function(stage["name"])
    files = {**dict(snakemake.input.items()), **dict(snakemake.output.items())}
    run_now = snakemake.config[RUN]
    exit_when_gone(run_now["process"])
    with logging_to(Path(str(snakemake.log[0])), run_now["options"]):
        print(f"{START_UP}{time.process_time():.3f} s")
        print(f"{RUN_WITH}{run_now['options']}")
        served = list(_served(stage, files))
        print(f"{SERVED}{len(served)}")
        progress = Progress(stage["name"], len(served), unit="subject")
        for one, own_files in served:
            run(**_arguments(run, own_files, one), **_resources(run, snakemake.config["resources"]))
            if len(served) > 1:
                progress.step()
        used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        print(f"{PROCESSOR_TIME}{sum(usage.ru_utime + usage.ru_stime for usage in used):.3f} s")
        print(f"{WALL_TIME}{time.monotonic() - began:.2f} s")
        print(f"{MEMORY}{max(usage.ru_maxrss for usage in used) / 1024.0:.0f} MB")


def _served(
    stage: Mapping[str, Any], files: Mapping[str, Any]
) -> Iterator[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Yield the params and the named files of each run of the stage."""
    if MEMBERS not in stage:
        yield stage, files
        return
    for number, member in enumerate(stage[MEMBERS]):
        ending = f"_{number}"
        yield (
            member,
            {name.removesuffix(ending): path for name, path in files.items() if name.endswith(ending)},
        )


def _arguments(
    run: Callable[..., None], files: Mapping[str, Any], stage: Mapping[str, Any]
) -> dict[str, Any]:
    """Match a rule's files and params with the arguments of a stage."""
    types = file_types(run)
    paths = {name: _as_paths(files[name], types[name]) for name in types if name in files}
    arguments = file_arguments(run, paths)
    arguments["settings"] = get_type_hints(run)["settings"].from_plain(stage["settings"])
    arguments["origin"] = Origin(stage["seed"], stage["subject"], stage["code"])
    return arguments


def _resources(run: Callable[..., None], configured: Mapping[str, Any]) -> dict[str, Any]:
    wanted = inspect.signature(run).parameters
    return {name: value for name, value in configured.items() if name in wanted}


def _as_paths(value: Any, hint: object) -> Path | tuple[Path, ...]:  # noqa: ANN401
    if hint is Path:
        return Path(str(value))
    return tuple(Path(str(item)) for item in ([value] if isinstance(value, str) else value))


@contextlib.contextmanager
def logging_to(path: Path, options: str = "") -> Iterator[None]:
    """Send log lines to a file and to the terminal; what libraries print and tracebacks go to the file alone.

    Args:
        path: The log file.
        options: What the study is run with beside the target, for the command that repairs an artefact.

    Raises:
        SystemExit: The block failed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    shown = terminal(sys.stderr)
    file = path.open("w", encoding="utf-8")
    handlers = [_handler(file), _handler(shown)]
    LOGGER.setLevel(logging.INFO)
    LOGGER.propagate = False
    for handler in handlers:
        LOGGER.addHandler(handler)
    try:
        with contextlib.redirect_stdout(file), contextlib.redirect_stderr(file):
            yield
        file.flush()
    except Exception as error:
        said = f"{type(error).__name__}: {_message(error, options, path)}\n(traceback: {path})"
        with contextlib.suppress(OSError):  # a full disk has no place for it
            traceback.print_exc(file=file)
        print(said, file=shown)
        raise SystemExit(EXIT_FAILURE) from None
    finally:
        for handler in handlers:
            LOGGER.removeHandler(handler)
        with contextlib.suppress(OSError):  # of what could not be flushed
            file.close()


def options_of(result: Path) -> str:
    """Return what Snakemake was given beside its targets, as the newest log of a result's study states."""
    folder = next(above / "logs" for above in result.parents if (above / "logs").is_dir())
    logs = sorted(folder.rglob("*.log"), key=lambda log: log.stat().st_mtime)
    lines = logs[-1].read_text(encoding="utf-8").splitlines() if logs else []
    return next((line.removeprefix(RUN_WITH) for line in lines if line.startswith(RUN_WITH)), "")


def _message(error: Exception, options: str, log: Path) -> str:
    if isinstance(error, DamagedArtefactError):
        return error.message(options)
    if isinstance(error, OSError) and error.filename is None and (reason := write_fault(error)):
        return f"{log}: cannot be written, {reason}"
    return str(error)


def _handler(stream: TextIO) -> logging.Handler:
    handler = logging.StreamHandler(stream)
    handler.setFormatter(logging.Formatter("%(message)s"))
    return handler

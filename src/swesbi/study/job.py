"""Running one stage as one job of the workflow: arguments by name, a log with tracebacks, short errors."""

from __future__ import annotations

import contextlib
import gc
import inspect
import json
import logging
import os
import pkgutil
import resource
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, get_type_hints

from pydantic import TypeAdapter

from swesbi.artefacts import DamagedArtefactError, Provenance
from swesbi.artefacts.atomic import UnfitError, write_fault
from swesbi.artefacts.typed import read_as, write_as
from swesbi.base.terminal import terminal
from swesbi.base.workers import exit_when_gone
from swesbi.study.running import RUN
from swesbi.study.stage import OF_EVERY_JOB, settings_in

if TYPE_CHECKING:
    from snakemake.iocontainers import Snakemake

LOGGER = logging.getLogger("swesbi")
START_UP = "start-up: "
"""Begins the line of a log that says what came before the stage, in seconds of processor time."""
RUN_WITH = "run with: "
"""Begins the line that gives what Snakemake was given beside its targets."""
PROCESSOR_TIME = "processor time: "
"""Begins the line that says what the whole job took, with the processes that it started."""
WALL_TIME = "wall time: "
MEMORY = "peak memory: "
DRAWN = ("_pdf", "_png")
"""Endings of the outputs of a figure."""


def run_job(snakemake: Snakemake) -> None:
    """Run the stage of one Snakemake job.

    The rule's named inputs become the arguments of the same names, its outputs are what the stage returns,
    and its params hold the settings by name (:func:`swesbi.study.stage.stage_params`). A resource of the
    configuration goes to a stage that has an argument of its name; it must not change a result. The job ends
    when the run that started it is gone.
    """
    began = time.monotonic() - time.process_time()  # nothing waits before this
    os.environ["MPLBACKEND"] = "agg"  # that of the caller's shell may be one that is not installed here
    params = settings_in(snakemake.params)
    function = pkgutil.resolve_name(params["stage"])  # its module is imported now, with all that it needs
    gc.freeze()  # what was imported stays, and is not searched for garbage
    run_now = snakemake.config[RUN]
    exit_when_gone(run_now["process"])
    inputs, outputs = (
        {name: _listed(value) for name, value in files.items()}
        for files in (snakemake.input, snakemake.output)
    )
    with logging_to(Path(str(snakemake.log[0])), run_now["options"], inputs):
        print(f"{START_UP}{time.process_time():.3f} s")
        print(f"{RUN_WITH}{run_now['options']}")
        run_stage(function, inputs, outputs, params, snakemake.config["resources"])
        used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        print(f"{PROCESSOR_TIME}{sum(usage.ru_utime + usage.ru_stime for usage in used):.3f} s")
        print(f"{WALL_TIME}{time.monotonic() - began:.2f} s")
        print(f"{MEMORY}{max(usage.ru_maxrss for usage in used) / 1024.0:.0f} MB")


def run_stage(
    function: Callable[..., Any],
    inputs: Mapping[str, Sequence[Path]],
    outputs: Mapping[str, Sequence[Path]],
    params: Mapping[str, Any],
    resources: Mapping[str, Any] = MappingProxyType({}),
) -> None:
    """Read what a stage takes, call it and write what it returns, all by its annotations.

    A stage returns what its only files hold, or a named tuple with a field an output. A field that is drawn
    has the files ``<field>_pdf`` and ``<field>_png``, and one that is None has none. An input that it does
    not name is only waited for.

    ``params`` are by name the settings, ``seed``, ``subject`` and ``code``. ``resources`` of the
    configuration go to arguments of their names.
    """
    hints, arguments = get_type_hints(function, include_extras=True), inspect.signature(function).parameters
    given = {name: read_as(hints[name], paths, name) for name, paths in inputs.items() if name in arguments}
    offered = {name: value for name, value in resources.items() if name in arguments}
    returned = function(**given, **typed_settings(function, params), **offered)
    recorded = {name: value for name, value in params.items() if name not in OF_EVERY_JOB}
    made = Provenance("", params["subject"], params["seed"], recorded, params["code"])
    for hint, value, files in _shared_out(hints["return"], returned, outputs):
        write_as(hint, value, files, made)


def typed_settings(function: Callable[..., Any], plain: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings that a stage takes by name, of the types that it says, from plain values."""
    hints = get_type_hints(function, include_extras=True)
    typed: dict[str, Any] = {
        name: TypeAdapter(hints[name]).validate_json(json.dumps(plain[name]))
        for name, argument in inspect.signature(function).parameters.items()
        if argument.kind is argument.KEYWORD_ONLY and argument.default is argument.empty
    }
    return typed


def _shared_out(
    hint: Any,  # noqa: ANN401
    returned: object,
    outputs: Mapping[str, Sequence[Path]],
) -> list[tuple[Any, Any, list[Path]]]:
    """Return the type, the value and the files of each part of what a stage returned."""
    if not hasattr(hint, "_fields"):
        return [(hint, returned, [path for paths in outputs.values() for path in paths])]
    of_field = {
        field: [name for name in (field, *(f"{field}{ending}" for ending in DRAWN)) if name in outputs]
        for field in hint._fields
        if getattr(returned, field) is not None
    }
    if not all(of_field.values()) or {name for names in of_field.values() for name in names} != set(outputs):
        given = tuple(of_field)
        raise TypeError(f"the rule has the outputs {', '.join(outputs)}, the stage returns {given}")
    types = get_type_hints(hint, include_extras=True)
    return [
        (types[field], getattr(returned, field), [path for name in names for path in outputs[name]])
        for field, names in of_field.items()
    ]


def _listed(value: Any) -> list[Path]:  # noqa: ANN401
    return [Path(str(path)) for path in ([value] if isinstance(value, str) else value)]


@contextlib.contextmanager
def logging_to(
    path: Path, options: str = "", inputs: Mapping[str, Sequence[Path]] = MappingProxyType({})
) -> Iterator[None]:
    """Send log lines to a file and to the terminal; what libraries print and tracebacks go to the file alone.

    An error ends in SystemExit. ``inputs`` has the files by the names under which errors may speak of them;
    ``options`` is what the study is run with, for the command that repairs an artefact.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    shown = terminal(sys.stderr)
    file = path.open("w", encoding="utf-8")
    handlers: list[logging.Handler] = [logging.StreamHandler(stream) for stream in (file, shown)]
    LOGGER.setLevel(logging.INFO)
    LOGGER.propagate = False
    for handler in handlers:
        LOGGER.addHandler(handler)
    try:
        with contextlib.redirect_stdout(file), contextlib.redirect_stderr(file):
            yield
        file.flush()
    except Exception as error:
        said = f"{type(error).__name__}: {_message(error, options, path, inputs)}\n(traceback: {path})"
        with contextlib.suppress(OSError):  # a full disk has no place for it
            traceback.print_exc(file=file)
        print(said, file=shown)
        raise SystemExit(1) from None
    finally:
        for handler in handlers:
            LOGGER.removeHandler(handler)
        with contextlib.suppress(OSError):  # of what could not be flushed
            file.close()


def options_of(folder: Path) -> str:
    """Return what Snakemake was given beside its targets, as the newest log of a folder states."""
    logs = sorted(folder.rglob("*.log"), key=lambda log: log.stat().st_mtime)
    lines = logs[-1].read_text(encoding="utf-8").splitlines() if logs else []
    return next((line.removeprefix(RUN_WITH) for line in lines if line.startswith(RUN_WITH)), "")


def _message(error: Exception, options: str, log: Path, inputs: Mapping[str, Sequence[Path]]) -> str:
    if isinstance(error, UnfitError) and (files := inputs.get(error.name)):
        return f"{files[0]}{' and others' if len(files) > 1 else ''}: {error.fault}"
    if isinstance(error, DamagedArtefactError):
        return error.message(options)
    if isinstance(error, OSError) and error.filename is None and (reason := write_fault(error)):
        return f"{log}: cannot be written, {reason}"
    return str(error)

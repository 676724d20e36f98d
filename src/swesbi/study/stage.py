"""A stage is a function, ``package.module:function``: what it depends on, and the params of its jobs.

What it takes before the ``*`` are artefacts, what follows are settings; one with a default is a resource, on
which no result depends. Light: Snakefiles read it, so a stage's module is not imported.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Protocol

from swesbi.study.code import Packages


class Named(Protocol):
    """Values by name, a view of the study say."""

    def __getitem__(self, name: str, /) -> Any:  # noqa: ANN401
        """Return one."""


Values = Callable[[dict[str, str]], Named]
"""Returns the plain settings by name that hold under a job's wildcards."""
OF_EVERY_JOB: Final = ("stage", "code", "seed", "subject")
"""Params beside the settings: function, hash of what it runs, seed of the study, subject if there is one."""


def stage_params(
    stage: str, values: Values, seed: int, sections: Mapping[str, Iterable[str]] = MappingProxyType({})
) -> dict[str, Any]:
    """Return the params of a rule that runs a stage, ``package.module:function``.

    Each carries its name, since Snakemake compares the values of params without theirs and prints those that
    differ. ``sections`` are keys of long settings by name: each becomes a param of its own.
    """

    def setting(name: str) -> Callable[[Any], dict[str, Any]]:
        return lambda wildcards: {name: values(dict(wildcards.items()))[name]}

    def section(name: str, key: str) -> Callable[[Any], dict[str, Any]]:
        return lambda wildcards: {name: {key: values(dict(wildcards.items()))[name][key]}}

    _, names = _code_and_settings(stage)
    return {
        "stage": {"stage": stage},
        "code": lambda _: {"code": stage_code(stage)},
        "seed": {"seed": seed},
        "subject": lambda wildcards: {"subject": wildcards.get("subject", "")},
        **{name: setting(name) for name in names if name not in sections},
        **{f"{name}_{key}": section(name, key) for name in names for key in sections.get(name, ())},
    }


def settings_in(params: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the values of a job's params by name, those of sections put together."""
    found: dict[str, Any] = {}
    for name, value in (item for param in params for item in param.items()):
        found[name] = {**found[name], **value} if name in found else value
    return found


def plain_settings(stage: str, values: Named) -> dict[str, Any]:
    """Return the plain settings that a stage depends on beside what every job has, out of many by name."""
    return {name: values[name] for name in _code_and_settings(stage)[1]}


def stage_code(stage: str) -> str:
    """Return the hash of the code that a stage runs."""
    return _code_and_settings(stage)[0]


@cache
def _code_and_settings(stage: str) -> tuple[str, list[str]]:
    """Return the hash of a stage's code and the names of its settings, kept beside the byte code."""
    module, _, name = stage.partition(":")
    packages, file, known = _known(module.partition(".")[0])
    if stage not in known:
        from swesbi.artefacts.atomic import ArtefactError, atomic_path  # numpy, which no help needs

        known[stage] = [packages.hash(module, name), packages.settings(module, name)]
        with contextlib.suppress(OSError, ArtefactError), atomic_path(file) as temporary:
            temporary.write_text(json.dumps(known))
    code, settings = known[stage]
    return code, [name for name in settings if name not in OF_EVERY_JOB]


@cache
def _known(package: str) -> tuple[Packages, Path, dict[str, Any]]:
    """Return the sources of this package and of one that imports it, a file of what is known, and that."""
    folders = dict.fromkeys(Path(str(files(name))) for name in ("swesbi", package))
    every = sorted(path for folder in folders for path in folder.rglob("*.*") if path.is_file())
    read = (str(path).encode() + path.read_bytes() for path in every if path.parent.name != "__pycache__")
    digest = hashlib.sha256(b"\0".join(read)).hexdigest()[:16]
    file = Path(__file__).parent / "__pycache__" / f"code-{package}.json"
    known = json.loads(file.read_text()) if file.is_file() else {}
    return Packages(*folders), file, known if known.get("of") == digest else {"of": digest}

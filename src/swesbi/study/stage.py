"""A stage is a function, ``package.module:function``: what it depends on, and the params of its jobs.

What it takes before the ``*`` are artefacts, what follows are settings; one with a default is a resource, on
which no result depends. Light: Snakefiles read it, so a stage's module is not imported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, Final, Protocol

from swesbi.study.code import code_of


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
    """Return the params of a rule that runs a stage.

    Each carries its name, since Snakemake compares the values of params without theirs and prints those that
    differ.

    Args:
        stage: ``package.module:function``.
        values: Gives the settings of a job.
        seed: Of the study.
        sections: Keys of long settings by name: each becomes a param of its own.
    """

    def setting(name: str) -> Callable[[Any], dict[str, Any]]:
        return lambda wildcards: {name: values(dict(wildcards.items()))[name]}

    def section(name: str, key: str) -> Callable[[Any], dict[str, Any]]:
        return lambda wildcards: {name: {key: values(dict(wildcards.items()))[name][key]}}

    names = _settings_of(stage)
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
    return {name: values[name] for name in _settings_of(stage)}


def stage_code(stage: str) -> str:
    """Return the hash of the code that a stage runs; errors as of ``swesbi.study.code.code_of``."""
    return code_of(stage)[0]


def _settings_of(stage: str) -> list[str]:
    return [name for name in code_of(stage)[1] if name not in OF_EVERY_JOB]

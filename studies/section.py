"""The section of a side study that was merged from several files: a later one may leave variants out."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, get_args, get_origin

from swesbi.base.settings import Settings
from swesbi.config.read import ConfigError


def left_out(section: Any, own: Mapping[str, Any], model: type[Settings]) -> Any:  # noqa: ANN401
    """Return a merged section without the variants for which a later file says null.

    Variants are the entries that the side study's own section has in fields which map names to settings. Null
    for anything else stays, and is refused or means what the field says.
    """
    if not isinstance(section, Mapping):
        return section
    kept = dict(section)
    for key in filter(section.__contains__, model.model_fields):
        if _has_variants(model, key) and isinstance(section[key], Mapping):
            known = own.get(key, {})
            variants = section[key].items()
            kept[key] = {name: one for name, one in variants if one is not None or name not in known}
    return kept


def _has_variants(model: type[Settings], key: str) -> bool:
    kind = model.model_fields[key].annotation
    value = get_args(kind)[1] if get_origin(kind) is dict else None
    return isinstance(value, type) and issubclass(value, Settings)


def check_experiment(section: str, name: str, known: Collection[str], kind: str) -> None:
    """Refuse an experiment of a section that is none of the known; ``kind`` says in words what these are."""
    if name not in known:
        there = ", ".join(known) or "none"
        raise ConfigError(f"{section}.experiment = {name!r} is no experiment {kind}; known: {there}")

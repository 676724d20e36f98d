"""The section of a side study that was merged from several files: a later one may leave variants out."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, get_args, get_origin

from swesbi.base.settings import Settings
from swesbi.config.read import ConfigError


def left_out(section: Any, own: Mapping[str, Any], model: type[Settings]) -> Any:  # noqa: ANN401
    """Return a section without the variants for which a later file says null.

    Variants are the entries of a field that maps names to settings, as readings are. Null for anything else
    stays, and is refused or means what the field says.

    Args:
        section: The section as merged.
        own: The section of the side study's own ``config.yaml``, which names the variants there are.
        model: The class of the section.
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
    """Refuse an experiment that a side study cannot ask about.

    Args:
        section: The side study's section.
        name: The experiment in it.
        known: Those that it could be.
        kind: What these are, in words.

    Raises:
        ConfigError: It is none of them.
    """
    if name not in known:
        there = ", ".join(known) or "none"
        raise ConfigError(f"{section}.experiment = {name!r} is no experiment {kind}; known: {there}")

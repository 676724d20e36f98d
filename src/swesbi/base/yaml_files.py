"""YAML as this project reads it: each key once, words as words, and no more values than a person writes.

``yes``, ``no``, ``on`` and ``off`` are texts, and so are dates and numbers with zeros before them: ``007`` is
the name of a subject.
"""

from __future__ import annotations

import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any, Final

import yaml

MOST_VALUES: Final = 100_000
DEEPEST: Final = 60
# as safe, and eight times faster where PyYAML has libyaml
SAFE: Final = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
WORDS: Final = {
    "tag:yaml.org,2002:bool": r"true|True|TRUE|false|False|FALSE",
    "tag:yaml.org,2002:null": r"~|null|Null|NULL|",
    "tag:yaml.org,2002:int": r"[-+]?(?:0|[1-9][0-9]*)",
    "tag:yaml.org,2002:float": r"[-+]?(?:(?:0|[1-9][0-9]*)\.[0-9]*|\.[0-9]+)(?:[eE][-+][0-9]+)?"
    r"|[-+]?\.inf|\.nan",
    "tag:yaml.org,2002:merge": r"<<",
}


class YamlError(ValueError):
    """A text that is no YAML mapping, or one that says a key twice or more than a person writes."""


class _Loader(SAFE):  # type: ignore[misc, valid-type]
    """As PyYAML's safe loader, but for the words that it knows and for keys that stand twice."""

    yaml_implicit_resolvers: Final[dict[str | None, list[tuple[str, re.Pattern[str]]]]] = {
        None: [(tag, re.compile(f"^(?:{pattern})$")) for tag, pattern in WORDS.items()]
    }

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        known: dict[str, int] = {}
        for key, _ in node.value:
            line = key.start_mark.line + 1
            if isinstance(key, yaml.ScalarNode):
                if (first := known.get(key.value)) is not None:
                    raise YamlError(f"has the key {key.value!r} twice, in lines {first} and {line}; keep one")
                known[key.value] = line
        return dict(super().construct_mapping(node, deep))


def yaml_mapping(text: str) -> dict[Any, Any]:
    """Return the keys and values of a YAML text."""
    try:
        _count(text)
        content = _Loader(text).get_single_data()
    # a ValueError of a number that is none
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        if isinstance(error, YamlError):
            raise
        raise YamlError(" ".join(f"cannot be read as YAML ({error})".split())) from error
    if not isinstance(content, dict):
        raise YamlError(f"holds {type(content).__name__}, expected keys with values")
    return content


def read_yaml_mapping(path: Path) -> dict[Any, Any]:
    """Return the keys and values of a YAML file."""
    try:
        return yaml_mapping(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise YamlError(f"cannot be read as YAML ({error})") from error


def _count(text: str) -> None:
    """Refuse a text of more values than ``MOST_VALUES``, each alias counted as what it stands for.

    Events come one by one, so nothing is built before it is counted.
    """
    sizes: dict[str, int] = {}
    open_nodes: list[tuple[str | None, int]] = []
    total = 0
    for event in yaml.parse(text, Loader=SAFE):
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise YamlError(f"has the alias *{event.anchor} before or within what it stands for")
            total += sizes[event.anchor]
        elif isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent):
            total += 1
            if isinstance(event, yaml.CollectionStartEvent):
                open_nodes.append((event.anchor, total - 1))
            elif event.anchor is not None:
                sizes[event.anchor] = 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_nodes.pop()
            if anchor is not None:
                sizes[anchor] = total - before
        if total > MOST_VALUES:
            raise YamlError(f"has more than {MOST_VALUES} values, its aliases counted; write them out")
        if len(open_nodes) > DEEPEST:
            raise YamlError(f"is more than {DEEPEST} levels deep; write fewer")

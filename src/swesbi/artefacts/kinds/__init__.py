"""The schemas of every kind of artefact, one module a part of the package."""

import importlib
import pkgutil
from collections.abc import Mapping
from typing import Final

from swesbi.artefacts.variable import Schema


def _collect() -> dict[str, Schema]:
    schemas: dict[str, Schema] = {}
    for module in pkgutil.iter_modules(__path__):
        schemas |= importlib.import_module(f"{__name__}.{module.name}").SCHEMAS
    return schemas


SCHEMAS: Final[Mapping[str, Schema]] = _collect()

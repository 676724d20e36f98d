"""The schemas of every kind of artefact, one module a part of the package.

A module has ``SCHEMAS`` and, where readers need text labels, ``LABELS``.
"""

import importlib
import pkgutil
from collections.abc import Mapping
from types import ModuleType
from typing import Final

from swesbi.artefacts.variable import Labels, Schema


def _modules() -> list[ModuleType]:
    return [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]


SCHEMAS: Final[Mapping[str, Schema]] = {
    kind: schema for module in _modules() for kind, schema in module.SCHEMAS.items()
}
LABELS: Final[Mapping[str, Labels]] = {
    kind: labels for module in _modules() for kind, labels in getattr(module, "LABELS", {}).items()
}

"""The JSON Schema of ``config.yaml``, for editors: ``python -m swesbi.config.schema`` writes it anew."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts import atomic_path
from swesbi.config.models import Config

SCHEMA: Final = Path("config.schema.json")
"""Where it lies, beside ``config.yaml``, whose first line names it."""
DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


def config_schema() -> dict[str, Any]:
    """Return the schema of the configuration's models.

    It knows keys, types, ranges and what each key means; what must fit together is checked when the
    configuration is read.
    """
    return {"$schema": DIALECT, **Config.model_json_schema()}


def schema_text() -> str:
    """Return the schema as the file holds it."""
    return json.dumps(config_schema(), indent=1, ensure_ascii=False) + "\n"


def main() -> int:
    """Write the file; return 0."""
    with atomic_path(SCHEMA) as temporary:
        temporary.write_text(schema_text(), encoding="utf-8", newline="\n")
    print(f"wrote {SCHEMA}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The JSON Schema of ``config.yaml``, for editors: ``python -m tools.schema FILE`` writes it."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts import atomic_path
from swesbi.config.models import Config

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


def config_schema() -> dict[str, Any]:
    """Return the schema of the configuration's models.

    It knows keys, types, ranges and what each key means; what must fit together is checked when the
    configuration is read.
    """
    return {"$schema": DIALECT, **Config.model_json_schema()}


def main(arguments: Sequence[str]) -> int:
    """Write the file; return 0."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.schema",
        description="Writes the JSON Schema of config.yaml, by which editors complete and check it.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="the file to write")
    path: Path = parser.parse_args(arguments).file
    text = json.dumps(config_schema(), indent=1, ensure_ascii=False) + "\n"
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

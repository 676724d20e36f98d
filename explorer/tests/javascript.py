"""JavaScript run by Node.js, as a page would run it; numbers come back as JSON or as doubles."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

NAMES = ("node", "nodejs")
PATIENCE_S = 600.0


def find_node(names: Sequence[str] = NAMES) -> str:
    """Return the program; skip the test where there is none, but fail in CI."""
    for name in names:
        if program := shutil.which(name):
            return program
    reason = f"no Node.js found ({', '.join(names)}); on Debian: apt-get install nodejs"
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


def evaluate(folder: Path, program: str, body: str, given: object = None) -> Any:  # noqa: ANN401
    """Return what a function body returns that stands behind a program, in the same scope.

    Args:
        folder: Where files may be written.
        program: Definitions.
        body: Of a function; ``given`` is its argument, ``doubles(...)`` keeps numbers for :func:`doubles`.
        given: Plain data.
    """
    (folder / "given.json").write_text(json.dumps(given))
    tail = f"""
const fs = require("fs");
function doubles(list) {{ fs.appendFileSync("doubles.bin", Buffer.from(Float64Array.from(list).buffer)); }}
const out = (function (given) {{ {body} }})(JSON.parse(fs.readFileSync("given.json", "utf8")));
fs.writeFileSync("out.json", JSON.stringify(out === undefined ? null : out));
"""
    (folder / "program.js").write_text(program + tail)
    (folder / "doubles.bin").write_bytes(b"")
    command = [find_node(), "--stack-size=4000", "program.js"]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads((folder / "out.json").read_text())


def doubles(folder: Path) -> np.ndarray:
    """Return the numbers that the last program kept, in order."""
    return np.fromfile(folder / "doubles.bin")

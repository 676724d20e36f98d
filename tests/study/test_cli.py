"""The command line: what `--help` costs."""

from __future__ import annotations

import subprocess
import sys

from swesbi.__main__ import COMMANDS

LIBRARIES = ("numpy", "pandas", "scipy", "pydantic", "h5py", "matplotlib", "torch", "xarray", "snakemake")
HELP_OF_ALL = f"""
import contextlib, sys
from swesbi.__main__ import COMMANDS, main
for command in ([], *([name] for name in COMMANDS)):
    with contextlib.suppress(SystemExit):
        main([*command, "--help"])
print(*[name for name in {LIBRARIES} if name in sys.modules], file=sys.stderr)
"""


def test_the_help_of_every_command_imports_no_library_and_prints_single_signs() -> None:
    run = subprocess.run([sys.executable, "-c", HELP_OF_ALL], capture_output=True, text=True, check=True)
    assert run.stderr == "\n"
    assert run.stdout.count("usage: swesbi") == 1 + len(COMMANDS)
    assert "k_sr=-20% " in run.stdout and "%%" not in run.stdout

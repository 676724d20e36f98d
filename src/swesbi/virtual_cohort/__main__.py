"""Command line: ``python -m swesbi.virtual_cohort data/virtual_volunteers``."""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

from swesbi.virtual_cohort.files import write_cohort
from swesbi.virtual_cohort.settings import ACQUISITION_SEED


def main() -> None:
    """Write the virtual cohort into the folder named on the command line."""
    parser = argparse.ArgumentParser(prog="python -m swesbi.virtual_cohort", description=main.__doc__)
    parser.add_argument("folder", type=Path, help="for example data/virtual_volunteers")
    parser.add_argument(
        "--acquisition-seed", type=int, default=ACQUISITION_SEED, help="noise of the recordings"
    )
    arguments = parser.parse_args()
    matplotlib.use("Agg")
    write_cohort(arguments.folder, arguments.acquisition_seed)


if __name__ == "__main__":
    main()

"""Command line: ``python -m swesbi.virtual_cohort data/virtual_volunteers``."""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib
import yaml

from swesbi.measurement.settings import MeasurementSettings
from swesbi.recording.settings import RecordingSettings
from swesbi.virtual_cohort.files import write_cohort, write_noise_levels
from swesbi.virtual_cohort.settings import ACQUISITION_SEED


def main() -> None:
    """Write the virtual cohort into the folder named on the command line."""
    parser = argparse.ArgumentParser(prog="python -m swesbi.virtual_cohort", description=main.__doc__)
    parser.add_argument("folder", type=Path, help="for example data/virtual_volunteers")
    parser.add_argument(
        "--acquisition-seed", type=int, default=ACQUISITION_SEED, help="noise of the recordings"
    )
    parser.add_argument(
        "--noise-levels",
        type=Path,
        metavar="CONFIG",
        help="measure first what noise of each level leaves, under this configuration's quality control",
    )
    arguments = parser.parse_args()
    matplotlib.use("Agg")
    if arguments.noise_levels:
        plain = yaml.safe_load(arguments.noise_levels.read_text(encoding="utf-8"))
        grid_points = MeasurementSettings.from_plain(plain["measurement"]).grid_points
        recording = RecordingSettings.from_plain(plain["recording"])
        write_noise_levels(arguments.folder, recording, grid_points)
    write_cohort(arguments.folder, arguments.acquisition_seed)


if __name__ == "__main__":
    main()

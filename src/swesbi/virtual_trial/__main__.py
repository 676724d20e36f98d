"""Command line: ``python -m swesbi.virtual_trial data/virtual_trial``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib

from swesbi.config.read import add_options, in_words, parse_config, parsed, read_merged
from swesbi.virtual_trial.files import write_trial
from swesbi.virtual_trial.settings import TRIAL
from swesbi.virtual_trial.source import source_of


def main() -> None:
    """Write the virtual trial into the folder named on the command line."""
    parser = argparse.ArgumentParser(prog="python -m swesbi.virtual_trial", description=main.__doc__)
    parser.add_argument("folder", type=Path, help="for example data/virtual_trial")
    add_options(parser)
    options = parsed(parser, sys.argv[1:])
    matplotlib.use("Agg")
    config = parse_config(
        read_merged(options.config, options.overlay), in_words(options.config, options.overlay)
    )
    write_trial(options.folder, source_of(config, TRIAL))


if __name__ == "__main__":
    main()

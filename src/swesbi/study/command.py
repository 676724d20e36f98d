"""What commands do alike: they read the study that options name, and go on where one of many is refused."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts.atomic import ArtefactError
from swesbi.config.read import in_words, merged_files, overlay, read_merged
from swesbi.config.study import Study, load_study
from swesbi.study.other_network import OtherNetworkError

REFUSALS: Final = (ValueError, ArithmeticError, RuntimeError)
"""Errors of one subject, person or group, which leave the others as they are; but for these:"""
OF_ALL: Final = (ArtefactError, OSError, OtherNetworkError)
"""Errors of the study, its network or the disk, and so of every subject of a folder."""


def study_of(
    options: argparse.Namespace, changes: Mapping[str, Any], new_cohort: Path | None = None
) -> Study:
    """Return the study of the configuration that a command is given, with what its other options change.

    Raises:
        ConfigError: The configuration, or the cohort, cannot be used.
    """
    given = (options.config, options.overlay)
    raw = overlay(read_merged(*given), changes)
    return load_study(raw, in_words(*given), new_cohort, merged_files(*given))


def study_with(folder: Path, options: argparse.Namespace) -> Study:
    """Return the study with a folder of recordings as the cohort of its new subjects; errors as above."""
    chosen = {} if options.phases is None else {"phases": options.phases}
    return study_of(options, {"new_subjects": chosen}, folder)

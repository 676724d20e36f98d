"""Which part of the study's configuration the page depends on, and what its job is told."""

from __future__ import annotations

from typing import Any, Final

from swesbi.config.slices import fields_of
from swesbi.config.study import Study

STAGE: Final = "explorer.stages:explorer"
SOURCES: Final = (
    "model experiment.exact experiment.misspecification.rule recording experiment=name cohort_title"
)
"""Fields of the stage's settings, as :data:`swesbi.config.slices.SOURCES` has those of the study's own."""


def page_settings(study: Study, experiment: str) -> dict[str, Any]:
    """Return what the page of an experiment on speeds depends on, plain and sorted by key.

    Raises:
        ConfigError: The study has no such experiment.
    """
    return dict(sorted(fields_of(study, {"experiment": experiment}, SOURCES).items()))

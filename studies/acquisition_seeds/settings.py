"""Settings of the study over acquisition seeds, and what its stage depends on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Final

from pydantic import Field

from swesbi.base.settings import Settings
from swesbi.config.slices import fields_of
from swesbi.config.study import Study

Seeds = Annotated[
    tuple[Annotated[int, Field(ge=0)], ...],
    Field(min_length=1, description="Seeds of the acquisition noise; each volunteer is recorded under each."),
]
JUDGED: Final = (
    "experiment.summary experiment.support experiment.predictive prior forward_model measurement passive "
    "recording passive_reference_prior=reference_prior"
)
"""What recordings under other seeds are judged by, as `fields_of` takes it."""


class AcquisitionSeedsSettings(Settings):
    """The virtual volunteers recorded anew, with other noise: the section ``acquisition_seeds``.

    The first seed is that of the shipped recordings.
    """

    seeds: Seeds


def judged_settings(study: Study, experiment: str, seeds: Sequence[int]) -> dict[str, Any]:
    """Return what recordings under these seeds are judged by, in an experiment on features.

    Raises:
        ConfigError: The study has no such experiment, or it is of another kind.
    """
    return fields_of(study, {"experiment": experiment}, JUDGED) | {"seeds": list(seeds)}

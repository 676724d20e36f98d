"""What answers a recording: a network or the prior, null distributions, and other hearts to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from swesbi.artefacts.files import stated_checksum
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.flow.flow import FlowProposal, flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.posterior.space import LogitSpace, Space
from swesbi.recording.observation import Observation
from swesbi.verdict.context import nearest_known
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.settings import SHIPPED_NULLS

OF_STUDY: Final = "of the prior of the study, which all of its subjects share"
OF_POPULATION: Final = "of the prior of the population that the network was trained on"
OF_PRIOR: Final = "of the prior from which the answer began"


@dataclass(frozen=True)
class Knowledge:
    """What answers recordings.

    Attributes:
        population: Whose prior the percentiles of an answer are of, in words.
        hearts: Contexts with which the subject's is compared.
        flow: The trained network; None: the inference begins with the prior.
        trained: Contexts that the network was trained on, if these are but some: it is shown the nearest.
        nulls: The null recordings that the tests compare with; None: nothing is judged.
        made_from: Checksums of the files that all of this was read from.
    """

    population: str = OF_PRIOR
    hearts: Sequence[Context] = ()
    flow: TrainedFlow | None = None
    trained: Sequence[Context] = ()
    nulls: NullRecordings | None = None
    made_from: tuple[str, ...] = ()

    def proposal(self, recording: SpeedRecording) -> FlowProposal | None:
        """Return the network's posterior of a recording; None where there is no network.

        Raises:
            ValueError: It is one of pushes, and the network knows the phases of its own subjects alone.
        """
        if self.flow is None:
            return None
        known = nearest_known(recording.context, self.trained) if self.trained else recording.context
        return flow_proposal(self.flow, replace(recording, context=known))

    def space(self, model: SpeedModel) -> Space:
        """Return the space in which the posterior of a gated recording's heart is nearest to normal."""
        return self.proposal(model.recording) or LogitSpace(model.settings.prior.simulated)


def knowledge_of_population(estimator: Path, null: Path) -> Knowledge:
    """Read what the network of a population knows.

    Args:
        estimator: The network.
        null: Null recordings.

    Raises:
        ArtefactError: A file is no such artefact.
    """
    nulls = NullRecordings.read(null)
    read = (stated_checksum(estimator), stated_checksum(null))
    return Knowledge(OF_POPULATION, nulls.contexts, TrainedFlow.read(estimator), nulls=nulls, made_from=read)


def knowledge_of_study(estimator: Path, observations: Sequence[Path], null: Path) -> Knowledge:
    """Read what the network of a study's cohort knows.

    Args:
        estimator: The network.
        observations: Observed curves of the cohort, whose contexts it was trained on.
        null: Null recordings.

    Raises:
        ArtefactError: A file is no such artefact.
    """
    trained = [Observation.read(path).context for path in observations]
    read = tuple(map(stated_checksum, (estimator, *observations, null)))
    flow, nulls = TrainedFlow.read(estimator), NullRecordings.read(null)
    return Knowledge(OF_STUDY, trained, flow, trained, nulls, read)


def knowledge_of_prior(null: Path = SHIPPED_NULLS) -> Knowledge:
    """Return what is known without a network: the prior, and null recordings.

    Raises:
        ArtefactError: These are damaged.
    """
    nulls = NullRecordings.read(null)
    return Knowledge(OF_PRIOR, nulls.contexts, nulls=nulls, made_from=(stated_checksum(null),))

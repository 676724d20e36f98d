"""What answers a recording: a network or the prior, null distributions, and other hearts to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

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


@dataclass(frozen=True)
class Knowledge:
    """What answers recordings.

    Without a network the inference begins with the prior. ``trained`` are the contexts that it was trained
    on, if these are but some: it is shown the nearest. ``made_from`` are checksums of the files of all this.
    """

    nulls: NullRecordings
    flow: TrainedFlow | None = None
    trained: Sequence[Context] = ()
    made_from: tuple[str, ...] = ()

    @property
    def hearts(self) -> Sequence[Context]:
        """Contexts with which the subject's is compared."""
        return self.trained or self.nulls.contexts

    @property
    def population(self) -> str:
        """Whose prior the percentiles of an answer are of, in words."""
        if self.flow is None:
            return "of the prior from which the answer began"
        if self.trained:
            return "of the prior of the study, which all of its subjects share"
        return "of the prior of the population that the network was trained on"

    def proposal(self, recording: SpeedRecording) -> FlowProposal | None:
        """Return the network's posterior of a recording; None where there is no network.

        A network that knows the phases of its own subjects alone refuses pushes by a ValueError.
        """
        if self.flow is None:
            return None
        known = nearest_known(recording.context, self.trained) if self.trained else recording.context
        return flow_proposal(self.flow, replace(recording, context=known))

    def space(self, model: SpeedModel) -> Space:
        """Return the space in which the posterior of a gated recording's heart is nearest to normal."""
        return self.proposal(model.recording) or LogitSpace(model.settings.prior.simulated)


def knowledge_from(null: Path, network: Path | None = None, cohort: Sequence[Path] = ()) -> Knowledge:
    """Read what answers recordings: the network of a population or of a study's cohort, or the prior.

    ``cohort`` are the observed curves whose contexts the network was trained on; none over a population.
    """
    nulls, trained = NullRecordings.read(null), [Observation.read(path).context for path in cohort]
    flow = None if network is None else TrainedFlow.read(network)
    read = tuple(map(stated_checksum, filter(None, (network, *cohort, null))))
    return Knowledge(nulls, flow, trained, read)

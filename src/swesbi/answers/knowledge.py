"""What answers a recording: a network or the prior, null distributions, and other hearts to compare with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

from swesbi.artefacts.files import stated_checksum
from swesbi.context import Context
from swesbi.measurement.instants import FreeModel
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import FlowProposal, TrainedFlow, flow_proposal, free_proposal
from swesbi.posterior.space import LogitSpace, Space
from swesbi.recording.observation import read_observation
from swesbi.verdict.context import nearest_known
from swesbi.verdict.pooled import PooledNull, PopulationNull, pool_subjects, read_null
from swesbi.verdict.pushes import PushChecks
from swesbi.verdict.recordings import NULL, read_subject_checks
from swesbi.verdict.settings import RuleSettings

SHIPPED_NULLS: Final = Path(__file__).with_name("nulls.h5")
"""Null recordings of the population of the shipped study; `tools.nulls` makes the file."""
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
        null: Loads the gated null recordings that the tests compare with; None where there are none.
        pushes: Those of free-running recordings; None where there are none.
        made_from: Checksums of the files that all of this was read from.
    """

    population: str = OF_PRIOR
    hearts: Sequence[Context] = ()
    flow: TrainedFlow | None = None
    trained: Sequence[Context] = ()
    null: Callable[[], PooledNull] | None = None
    pushes: PushChecks | None = None
    made_from: tuple[str, ...] = ()

    def of_phases(self, recording: SpeedRecording) -> FlowProposal | None:
        """Return the network's posterior of a gated recording."""
        if self.flow is None:
            return None
        known = nearest_known(recording.context, self.trained) if self.trained else recording.context
        return flow_proposal(self.flow, replace(recording, context=known))

    def space(self, model: SpeedModel) -> Space:
        """Return the space in which the posterior of a gated recording is nearest to normal."""
        return self.of_phases(model.recording) or LogitSpace(model.settings.prior)

    def of_pushes(self, model: FreeModel) -> FlowProposal | None:
        """Return the network's posterior of a free-running recording.

        Raises:
            ValueError: The network was trained on recordings of known phases alone.
        """
        return None if self.flow is None else free_proposal(self.flow, model)


def of_population(whose: str, flow: TrainedFlow | None, null: PopulationNull) -> Knowledge:
    """Return what is known by the null recordings of a population, and by a network where there is one."""
    return Knowledge(whose, null.contexts, flow, null=lambda: null.pooled, pushes=null.pushes)


def knowledge_of_population(estimator: Path, null: Path) -> Knowledge:
    """Read what the network of a population knows.

    Args:
        estimator: The network.
        null: Null recordings of the population; without the file there are none, and nothing is judged.

    Raises:
        ArtefactError: A file is no such artefact.
    """
    flow, _ = load_flow(estimator)
    if not null.is_file():
        return Knowledge(OF_POPULATION, (), flow)
    population = read_null(null)
    read = (stated_checksum(estimator), stated_checksum(null))
    return replace(of_population(OF_POPULATION, flow, population), made_from=read)


def knowledge_of_study(
    estimator: Path, observations: Sequence[Path], misspecifications: Sequence[Path], rule: RuleSettings
) -> Knowledge:
    """Read what the network of a study's cohort knows.

    Args:
        estimator: The network.
        observations: Observed curves of the cohort, whose contexts it was trained on.
        misspecifications: Null distributions of the cohort.
        rule: How these are taken together.

    Raises:
        ArtefactError: A file is no such artefact.
    """
    trained = [read_observation(path).context for path in observations]

    @cache
    def pooled() -> PooledNull:
        return pool_subjects([read_subject_checks(path, (NULL,)) for path in misspecifications], rule)

    read = tuple(map(stated_checksum, (estimator, *observations, *misspecifications)))
    return Knowledge(OF_STUDY, trained, load_flow(estimator)[0], trained, pooled, made_from=read)


def knowledge_of_prior() -> Knowledge:
    """Return what is known without a study: the prior, and the null distributions that are shipped.

    Raises:
        ArtefactError: These are damaged.
    """
    known = of_population(OF_PRIOR, None, read_null(SHIPPED_NULLS))
    return replace(known, made_from=(stated_checksum(SHIPPED_NULLS),))

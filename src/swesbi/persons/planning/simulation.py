"""The bank of a planned study: simulated persons, answered as any subject and any two visits are."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from pydantic import Field, JsonValue

from swesbi.base.arrays import FloatArray
from swesbi.base.processes import WorkerKilledError, side_by_side
from swesbi.base.progress import Progress
from swesbi.base.settings import Settings
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.parameters import OF_THETA, THETA_NAMES
from swesbi.persons.change.joint import OwnPosterior, both_visits, infer_change, own_posterior
from swesbi.persons.change.settings import ChangeSettings
from swesbi.persons.planning.bank import ARMS, Bank, bank_of
from swesbi.persons.planning.effect import Effect
from swesbi.persons.planning.persons import STREAM, PlannedPerson, draw_planned, trial_model, trial_of
from swesbi.persons.planning.settings import Design, PlannedPersonsSettings
from swesbi.population.settings import PopulationSettings, of_group
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.virtual.trial.source import TrialSource, noisier

LOGGER = logging.getLogger("swesbi")
BATCH: Final = 4
"""Persons between two savings."""


class BankSettings(Settings):
    """Who is drawn, what happens to them, how they are recorded, and what answers depend on."""

    design: Design
    parameter: str = Field(description="parameter of theta that the effect is on")
    change: float = Field(gt=-1.0, description="of it, as a fraction")
    repeats: int = Field(ge=2, description="at a phase")
    repeat_noise: float = Field(gt=0.0, lt=0.5, description="sd of one repeat's speed, as a fraction")
    persons: PlannedPersonsSettings
    model: SpeedModelSettings
    exact: ExactSettings
    changes: ChangeSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    grid_points: int
    lvesv_fraction: float
    population: PopulationSettings
    train_population: dict[str, JsonValue] = Field(description="what the network was trained under")

    @property
    def effect(self) -> Effect:
        """What happens to the middle person."""
        return Effect(self.parameter, self.change)

    @property
    def noise_factor(self) -> float:
        """Errors of the recordings over those of ``acquisition``."""
        return self.repeat_noise / self.acquisition.repeat_sd_fraction

    @property
    def noise(self) -> NoiseComponents:
        """Of the recordings."""
        of = noisier(self.acquisition, self.noise_factor)
        return NoiseComponents(of.repeat_sd_fraction, of.sample_sd_fraction, of.sweep_fraction)

    def source(self, seed: int) -> TrialSource:
        """Return what persons are drawn with."""
        acquisition = noisier(self.acquisition, self.noise_factor)
        return TrialSource(
            trial=trial_of(self.persons),
            population=of_group(self.population, self.persons.group),
            model=trial_model(self.model, self.persons),
            bounds=self.model.prior,
            acquisition=acquisition.model_copy(update={"repeats": self.repeats, "scale_fraction": 0.0}),
            recording=self.recording,
            grid_points=self.grid_points,
            lvesv_fraction=self.lvesv_fraction,
            seed=seed,
        )


def answered_bank(
    network: TrainedFlow,
    kept: Bank | None,
    settings: BankSettings,
    *,
    seed: int,
    processes: int = 1,
) -> Iterator[Bank]:
    """Simulate and answer the persons of a planned study, with the effect and without it.

    Args:
        network: Of the population.
        kept: Persons who were answered before, made alike; None: nobody was.
        settings: What a bank depends on.
        seed: Of everything.
        processes: Persons that are answered side by side; no answer depends on it.

    Yields:
        The bank with all who are answered, after every few persons and at the end.

    Raises:
        ValueError: Nobody takes part, nobody could be answered, or the process of a person was killed.
    """
    simulator = BankSimulator(network, settings, seed)
    done = [] if kept is None else [kept.before(settings.persons.number)]
    there = {int(number) for bank in done for number in bank.number}
    missing = [number for number in range(settings.persons.number) if number not in there]
    label = f"persons of the bank, {settings.repeats} repeats"
    progress = Progress(label, len(missing), unit="person")
    for number, person in side_by_side(simulator.person, missing, processes):
        killed = isinstance(person, WorkerKilledError)
        if isinstance(person, Bank):
            done.append(person)
        progress.step()
        if done and (killed or progress.done % BATCH == 0 or progress.done == len(missing)):
            yield bank_of(done)
        if killed:
            raise ValueError(
                f"person {number} of the bank: {person}; type the same again with fewer --processes: "
                "persons that are done are kept"
            )
    if not done:
        raise ValueError("nobody of the bank could be answered: every simulation of their posteriors failed")


@dataclass(frozen=True)
class BankSimulator:
    """Draws the persons of a bank and answers them.

    Attributes:
        network: Of the population.
        settings: Of the bank.
        seed: The study's seed.
    """

    network: TrainedFlow
    settings: BankSettings
    seed: int

    def person(self, number: int) -> Bank | None:
        """Draw, record and answer the person of this number; None where every simulation failed.

        Raises:
            ValueError: Nobody takes part in this place.
        """
        settings = self.settings
        drawn = draw_planned(
            number, settings.design, settings.effect, settings.persons.response_spread,
            settings.source(self.seed),
        )  # fmt: skip
        try:
            return self._changes(drawn, drawn.earlier) if drawn.earlier is not None else self._levels(drawn)
        except NoLikelihoodError as error:
            LOGGER.info("person %d of the bank is left out: %s", number, error)
            return None

    def _levels(self, drawn: PlannedPerson) -> Bank:
        """Return theta of one visit in both arms."""
        posteriors = [self._exact(observed)[0] for observed in drawn.arms]
        none = np.full((len(ARMS), len(THETA_NAMES)), np.nan)
        draws = [exact.phi[:, OF_THETA] for exact in posteriors]
        return _bank_person(drawn, drawn.theta, draws, (none, none, none), posteriors)

    def _changes(self, drawn: PlannedPerson, before: Observation) -> Bank:
        """Return the ratio of both visits in both arms, and whether one person's change is called."""
        earlier = self._own(before)
        settings, changes = self.settings, []
        for arm, observed in zip(ARMS, drawn.arms, strict=True):
            later = self._own(observed)
            both = both_visits([earlier[0], later[0]], [before, observed], settings.changes)
            own = [earlier[1], later[1]]
            name = (STREAM, drawn.number, arm)
            changes.append(infer_change(both, own, settings.changes, self.seed, *name))
        told = tuple(
            np.stack([getattr(change.ratios, name)[OF_THETA] for change in changes])
            for name in ("risen", "fallen", "detectable")
        )
        draws = [later / earlier for earlier, later in (change.phi[:, :, OF_THETA] for change in changes)]
        posteriors = [change.exact for change in changes]
        return _bank_person(drawn, drawn.theta / drawn.theta_earlier, draws, told, posteriors)

    def _own(self, observed: Observation) -> tuple[SpeedModel, OwnPosterior]:
        exact, model = self._exact(observed)
        return model, own_posterior(exact, flow_proposal(self.network, model.recording))

    def _exact(self, observed: Observation) -> tuple[ExactPosterior, SpeedModel]:
        settings = self.settings
        model = SpeedModel(measured_speeds(observed, settings.noise), settings.model)
        proposal = flow_proposal(self.network, model.recording)
        names = (STREAM, settings.repeats, observed.context.subject)
        return exact_posterior(HeartModel(model), proposal, settings.exact, self.seed, *names)[0], model


def _bank_person(
    drawn: PlannedPerson,
    truth: FloatArray,
    draws: Sequence[FloatArray],
    told: tuple[FloatArray, ...],
    posteriors: Sequence[ExactPosterior],
) -> Bank:
    """Return the bank of one person: truth (2, 3), draws (n, 3) of both arms, what is told of them (2, 3)."""
    risen, fallen, detectable = (each[None] for each in told)
    return Bank(
        arm=ARMS,
        number=np.array([float(drawn.number)]),
        mean=np.stack([np.log(each).mean(axis=0) for each in draws])[None],
        covariance=np.stack([np.cov(np.log(each).T) for each in draws])[None],
        truth=truth[None],
        risen=risen,
        fallen=fallen,
        detectable=detectable,
        efficiency=np.array([[exact.efficiency for exact in posteriors]]),
        converged=np.array([[float(exact.converged) for exact in posteriors]]),
        redrawn=np.array([float(drawn.redrawn)]),
    )

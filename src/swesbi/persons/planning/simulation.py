"""The bank of a planned study: simulated persons, answered as any subject and any two visits are.

Persons are drawn as those of the virtual trial, and recorded with the effect and without. Both recordings
have the same heart rate, errors of clinical measures and noise of repeats and samples: nobody is ever in one
study twice, and what both have in common says how a bank errs (``planning.likelihoods``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
from pydantic import Field, JsonValue

from swesbi.artefacts import Artefact, Labels, Variable
from swesbi.base.arrays import FloatArray, below_each_other, rows_of
from swesbi.base.progress import LOGGER, Progress
from swesbi.base.settings import Settings
from swesbi.base.workers import WorkerKilledError, side_by_side
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.flow.trained import FlowProposal, TrainedFlow, flow_proposal
from swesbi.parameters import OF_THETA, THETA_NAMES
from swesbi.persons.change.joint import both_visits, infer_change
from swesbi.persons.planning.effect import Effect
from swesbi.persons.settings import PAIRED, ChangeSettings, Design, PlannedPersonsSettings
from swesbi.population.contexts import draw_one
from swesbi.population.settings import PopulationSettings, of_group
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import sample
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator
from swesbi.virtual.trial import (
    AFTER,
    BEFORE,
    CONTROL,
    MAX_ATTEMPTS,
    MECHANICS,
    DrawnAgain,
    TrialSettings,
    TrialSource,
    at_visit,
    check_bounds,
    narrowed,
    noisier,
    phi_at_visit,
    record_visit,
)

NONE: Final = "none"
EFFECT: Final = "effect"
ARMS: Final = (NONE, EFFECT)
"""Without the effect and with it, of every person."""
BATCH: Final = 4
"""Persons between two savings."""
STREAM: Final = "plan"
Theta = Mapping[str, float]


@dataclass(frozen=True)
class Bank(Artefact, kind="plan_bank"):
    """Persons of a bank, N of them, in both arms.

    What is inferred of a person is kept as a normal summary: mean and covariance of the logarithms of the
    draws, of the ratio of both visits or of theta.
    """

    arm: Annotated[tuple[str, ...], Labels("arm")]
    number: Annotated[FloatArray, Variable("person", "1", "number of the person")]
    mean: Annotated[
        FloatArray, Variable("person arm parameter", "1", "posterior mean of the logarithm of ratio or theta")
    ]
    covariance: Annotated[
        FloatArray, Variable("person arm parameter other_parameter", "1", "its posterior covariance")
    ]
    truth: Annotated[FloatArray, Variable("person arm parameter", "as asked", "true ratio, or theta")]
    risen: Annotated[
        FloatArray,
        Variable("person arm parameter", "1", "probability of a rise beyond the threshold; NaN of one visit"),
    ]
    fallen: Annotated[
        FloatArray,
        Variable("person arm parameter", "1", "probability of a fall beyond the threshold; NaN of one visit"),
    ]
    detectable: Annotated[
        FloatArray,
        Variable("person arm parameter", "1", "smallest change that can be detected; NaN of one visit"),
    ]
    efficiency: Annotated[FloatArray, Variable("person arm", "1", "effective share of the weighted draws")]
    converged: Annotated[FloatArray, Variable("person arm", "1", "1 where draws are reliable, else 0")]
    redrawn: Annotated[FloatArray, Variable("person", "1", "persons drawn before who did not take part")]

    def before(self, number: int) -> Bank:
        """Return the persons whose number is below this."""
        return rows_of(self, self.number < number)


def bank_of(parts: Sequence[Bank]) -> Bank:
    """Return the persons of several banks, at least one, in the order of their numbers."""
    whole = below_each_other(parts)
    return rows_of(whole, np.argsort(whole.number, kind="stable"))


@dataclass(frozen=True)
class PlannedPerson:
    """One person of a bank, recorded: without the effect and with it, and before it where persons come twice.

    ``truth`` (2, 3) is of both arms, the true ratio of both visits, or theta of those who come once.
    ``redrawn`` counts persons who were drawn in this place before and did not take part.
    """

    number: int
    earlier: Observation | None
    arms: tuple[Observation, Observation]
    truth: FloatArray
    redrawn: int


def draw_planned(
    number: int, design: str, effect: Effect, response_spread: float, source: TrialSource
) -> PlannedPerson:
    """Draw the person of this number, whatever the others; who does not take part is drawn again.

    ``response_spread`` is of the logarithm of the effect between persons. Raises ValueError after many draws.
    """
    reasons = []
    for attempt in range(MAX_ATTEMPTS):
        try:
            return _drawn(number, design, effect, response_spread, source, attempt)
        except DrawnAgain as reason:
            reasons.append(str(reason))
    raise ValueError(
        f"person {number} of the bank: nobody took part in {MAX_ATTEMPTS} draws, for {sorted(set(reasons))}; "
        f"an effect of {effect.words} may lie beyond the prior's bounds: name a smaller one"
    )


def _drawn(
    number: int,
    design: str,
    effect: Effect,
    response_spread: float,
    source: TrialSource,
    attempt: int,
) -> PlannedPerson:
    rng = generator(source.seed, STREAM, "person", number, attempt)
    context = draw_one(number, source.population, rng).context
    own = dict(zip(source.model.prior.names, sample(1, source.model.prior, rng)[0].tolist(), strict=True))
    earlier, before = None, dict.fromkeys(THETA_NAMES, 1.0)
    if design == PAIRED:
        before = phi_at_visit(own, BEFORE, CONTROL, source, rng)
        earlier = _observed(context, BEFORE, before, f"{number}-before", source, rng)
    visit = AFTER if design == PAIRED else BEFORE
    phi = phi_at_visit(own, visit, CONTROL, source, rng)
    response = effect.factor * float(np.exp(response_spread * rng.standard_normal()))
    changed = phi | {effect.parameter: response * phi[effect.parameter]}
    check_bounds(changed, source.bounds)
    # Both arms have one day and one noise: what the bank errs by is the same in both, and known from one.
    day, same_day = (generator(source.seed, STREAM, "recording", number, attempt) for _ in range(2))
    arms = (
        _observed(context, visit, phi, f"{number}-none", source, day),
        _observed(context, AFTER, changed, f"{number}-effect", source, same_day),
    )
    truth = np.stack([_theta(phi), _theta(changed)]) / _theta(before)
    return PlannedPerson(number, earlier, arms, truth, redrawn=attempt)


def _observed(
    context: Context, visit: str, phi: Theta, name: str, source: TrialSource, rng: np.random.Generator
) -> Observation:
    """Record a visit and ingest it; a visit after the first need not have the ejection fraction of health."""
    of_day = replace(at_visit(context, visit, source, rng), subject=f"plan-{name}")
    made = record_visit(of_day, visit, phi, source, rng)
    return ingest(made.samples, made.context, source.recording, source.grid_points)


def _theta(phi: Theta) -> FloatArray:
    return np.array([phi[name] for name in THETA_NAMES])


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
    def noisy(self) -> AcquisitionSettings:
        """The acquisition with the errors of the recordings."""
        return noisier(self.acquisition, self.repeat_noise / self.acquisition.repeat_sd_fraction)

    @property
    def noise(self) -> NoiseComponents:
        """Of the recordings."""
        of = self.noisy
        return NoiseComponents(of.repeat_sd_fraction, of.sample_sd_fraction, of.sweep_fraction)

    def source(self, seed: int) -> TrialSource:
        """Return what persons are drawn with, as those of a trial; the bank puts in the treatment by itself.

        Their mechanics are richer than the inference's, and their prior is narrower.
        """
        persons = self.persons
        return TrialSource(
            trial=TrialSettings(
                persons_per_group=persons.number,
                population_group=persons.group,
                prior_share=persons.prior_share,
                theta_spread=persons.visit_spread,
                passive_spread=persons.passive_spread,
                loading_spread=persons.loading_spread,
                heart_rate_spread=persons.heart_rate_spread,
                kept_scale_share=persons.kept_scale_share,
                weeks_between=persons.weeks_between,
                effect={},
                ejection_fraction=persons.ejection_fraction,
            ),
            population=of_group(self.population, persons.group),
            model=self.model.model_copy(
                update={"prior": narrowed(self.model.prior, persons.prior_share), "forward_model": MECHANICS}
            ),
            bounds=self.model.prior,
            acquisition=self.noisy.model_copy(update={"repeats": self.repeats, "scale_fraction": 0.0}),
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

    Yields the bank with all who are answered, ``kept`` ones of an earlier run included, after every few
    persons and at the end. No answer depends on the number of processes. Raises ValueError where nobody takes
    part or could be answered, or the process of a person was killed.
    """
    done = [] if kept is None else [kept.before(settings.persons.number)]
    there = {int(number) for bank in done for number in bank.number}
    missing = [number for number in range(settings.persons.number) if number not in there]
    progress = Progress(f"persons of the bank, {settings.repeats} repeats", len(missing), unit="person")
    for number, person in side_by_side(BankSimulator(network, settings, seed).person, missing, processes):
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
    """Draws the persons of a bank and answers them."""

    network: TrainedFlow
    settings: BankSettings
    seed: int

    def person(self, number: int) -> Bank | None:
        """Draw, record and answer the person of this number; None where every simulation failed."""
        settings = self.settings
        drawn = draw_planned(
            number, settings.design, Effect(settings.parameter, settings.change),
            settings.persons.response_spread, settings.source(self.seed),
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
        return _bank_person(drawn, draws, (none, none, none), posteriors)

    def _changes(self, drawn: PlannedPerson, before: Observation) -> Bank:
        """Return the ratio of both visits in both arms, and whether one person's change is called."""
        exact_before, model_before, space_before = self._exact(before)
        settings, changes = self.settings.changes, []
        for arm, observed in zip(ARMS, drawn.arms, strict=True):
            exact, model, space = self._exact(observed)
            both = both_visits([model_before, model], [before, observed], settings)
            own, spaces = [exact_before, exact], [space_before, space]
            name = (STREAM, drawn.number, arm)
            changes.append(infer_change(both, own, spaces, settings, self.seed, *name))
        told = tuple(
            np.stack([getattr(change.ratios, name)[OF_THETA] for change in changes])
            for name in ("risen", "fallen", "detectable")
        )
        draws = [later / earlier for earlier, later in (change.phi[:, :, OF_THETA] for change in changes)]
        return _bank_person(drawn, draws, told, [change.exact for change in changes])

    def _exact(self, observed: Observation) -> tuple[ExactPosterior, SpeedModel, FlowProposal]:
        settings = self.settings
        model = SpeedModel(measured_speeds(observed, settings.noise), settings.model)
        proposal = flow_proposal(self.network, model.recording)
        names = (STREAM, settings.repeats, observed.context.subject)
        exact, _ = exact_posterior(HeartModel(model), proposal, settings.exact, self.seed, *names)
        return exact, model, proposal


def _bank_person(
    drawn: PlannedPerson,
    draws: Sequence[FloatArray],
    told: tuple[FloatArray, ...],
    posteriors: Sequence[ExactPosterior],
) -> Bank:
    """Return the bank of one person: draws (n, 3) of both arms, and what is told of them (2, 3)."""
    risen, fallen, detectable = (each[None] for each in told)
    return Bank(
        arm=ARMS,
        number=np.array([float(drawn.number)]),
        mean=np.stack([np.log(each).mean(axis=0) for each in draws])[None],
        covariance=np.stack([np.cov(np.log(each).T) for each in draws])[None],
        truth=drawn.truth[None],
        risen=risen,
        fallen=fallen,
        detectable=detectable,
        efficiency=np.array([[exact.efficiency for exact in posteriors]]),
        converged=np.array([[float(exact.converged) for exact in posteriors]]),
        redrawn=np.array([float(drawn.redrawn)]),
    )

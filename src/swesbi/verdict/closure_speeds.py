"""Does the model make the speeds of natural waves that people have? Waves of which it does not mean nothing.

Speeds at the closures of both valves are drawn from the prior predictive of healthy hearts and held against
what was measured in healthy volunteers. The rule is that of the configuration, and is applied here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swesbi.arrays import FloatArray
from swesbi.context import Context
from swesbi.draws import median_and_interval
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.measurement.natural_waves import predict_at_closures
from swesbi.measurement.speeds import SpeedRecording
from swesbi.population.contexts import draw_contexts
from swesbi.population.settings import PopulationSettings
from swesbi.prior import draw_prior
from swesbi.recording.columns import EVENTS
from swesbi.recording.free_observation import FreeObservation
from swesbi.seeds import generator
from swesbi.verdict.answers import NOT_INTERPRETABLE
from swesbi.verdict.settings import NaturalWavesSettings, PublishedSpeed

STREAM = "closure speeds"


class NotInterpretableError(ValueError):
    """A recording has natural waves alone, of which the model does not make the speeds that people have."""


@dataclass(frozen=True)
class ClosureSpeeds:
    """Speeds in m/s of natural waves of one event that the model predicts in health, beside published ones.

    Attributes:
        event: Whose closure sets them off.
        low: Lower end of the central mass of the prior predictive.
        median: Its median.
        high: Upper end.
        published: What was measured of healthy volunteers.
    """

    event: str
    low: float
    median: float
    high: float
    published: tuple[PublishedSpeed, ...]

    @property
    def missed(self) -> tuple[PublishedSpeed, ...]:
        """The published means that lie outside of what the model predicts."""
        return tuple(one for one in self.published if not self.low <= one.mean_m_s <= self.high)

    @property
    def interpretable(self) -> bool:
        """Whether the model predicts every published mean, so that waves of the event say something of it."""
        return not self.missed

    def why_not(self) -> str:
        """Say why waves of the event are not interpreted."""
        measured = "; ".join(f"{one.mean_m_s:.2f} ({one.source})" for one in self.missed)
        return (
            f"waves after {self.event} are {NOT_INTERPRETABLE}: in healthy hearts the model predicts "
            f"{self.low:.2f} to {self.high:.2f} m/s there, and people have {measured}"
        )


def closure_speeds(
    model: SpeedModelSettings, population: PopulationSettings, waves: NaturalWavesSettings, seed: int
) -> tuple[ClosureSpeeds, ...]:
    """Apply the rule to the waves of each event, in the order of ``EVENTS``.

    Args:
        model: Of an experiment on speeds, with its prior.
        population: Healthy hearts.
        waves: The rule, and published speeds.
        seed: The study's seed; the outcome is the same for every recording.
    """
    return judged(prior_predictive(model, population, waves, seed), waves)


def interpretable(
    observed: FreeObservation, outcome: Sequence[ClosureSpeeds]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the events of a recording whose waves are interpreted, and why those of others are not.

    Raises:
        NotInterpretableError: Nothing of the recording is left.
    """
    own = [one for one in outcome if (observed.event == one.event).any()]
    events = tuple(one.event for one in own if one.interpretable)
    left_out = tuple(one.why_not() for one in own if not one.interpretable)
    if not events and not observed.is_push.any():
        raise NotInterpretableError(f"{observed.subject}: {NOT_INTERPRETABLE}: {'; '.join(left_out)}")
    return events, left_out


def prior_predictive(
    model: SpeedModelSettings, population: PopulationSettings, waves: NaturalWavesSettings, seed: int
) -> Mapping[str, FloatArray]:
    """Draw the mean speed in m/s of a heart's natural waves of each event, what the model misses included.

    Args:
        model: Of an experiment on speeds, with its prior.
        population: Whose contexts.
        waves: Numbers of contexts and draws, and what the waves of a recording share.
        seed: Seed of everything.
    """
    contexts = draw_contexts(range(waves.contexts), population, seed, STREAM)
    drawn = [_log_speeds(model, context, waves, seed, index) for index, context in enumerate(contexts)]
    log_speed = np.vstack(drawn)
    return {
        event: np.exp(column[np.isfinite(column)]) for event, column in zip(EVENTS, log_speed.T, strict=True)
    }


def _log_speeds(
    settings: SpeedModelSettings, context: Context, waves: NaturalWavesSettings, seed: int, index: int
) -> FloatArray:
    """Return log speeds of one heart; shape (draws, events), NaN where a simulation failed."""
    rng = generator(seed, STREAM, index)
    none = np.empty(0)
    model = speed_model(SpeedRecording(context, none, none, none, np.empty((0, 0))), settings)
    phi = draw_prior(settings.prior, waves.draws_per_context, rng)
    noiseless = predict_at_closures(model, phi, model.simulate(phi)).log_speed
    omega = np.array([waves.closure(event).wave_log_sd for event in EVENTS])
    missed = np.hypot(omega, settings.discrepancy.speed_fraction)
    return np.asarray(noiseless + missed * rng.standard_normal(noiseless.shape))


def judged(speeds: Mapping[str, FloatArray], waves: NaturalWavesSettings) -> tuple[ClosureSpeeds, ...]:
    """Hold drawn speeds in m/s, (k,) of each event, against published ones."""
    outcome = []
    for event, drawn in speeds.items():
        low, median, high = map(float, median_and_interval(drawn, waves.central_mass))
        outcome.append(ClosureSpeeds(event, low, median, high, waves.closure(event).published))
    return tuple(outcome)

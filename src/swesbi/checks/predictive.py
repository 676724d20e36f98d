"""Prior and posterior predictive checks of one subject, in memory and as artefact."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Final

from swesbi.artefacts import Artefact, Group, Labels, Part, Provenance, Variable, from_groups
from swesbi.base.arrays import BoolArray, FloatArray, rows_of
from swesbi.checks.scores import (
    NO_COVERAGES,
    NO_SCORES,
    Band,
    Coverages,
    FeatureCheck,
    Scores,
    band,
    cover,
    coverage,
    score,
)
from swesbi.measurement.settings import SummarySettings, summary_names
from swesbi.measurement.summary import summarise
from swesbi.parameters import THETA_COLUMNS, THETA_NAMES
from swesbi.recording.observation import Observation

LOGGER = logging.getLogger("swesbi")
FEATURE_UNITS: Final = "as named in feature"
MEASURED: Final = "measured phases"


@dataclass(frozen=True)
class Draws:
    """n successful simulations: parameters, curves as measured, and what a cardiologist reads."""

    theta: Annotated[FloatArray, Variable("draw parameter", THETA_COLUMNS, "active parameters")]
    curve_kpa: Annotated[FloatArray, Variable("draw grid", "kPa", "total stiffness on the grid, as measured")]
    phase_kpa: Annotated[
        FloatArray, Variable("draw phase", "kPa", "total stiffness at the phases of the recording")
    ]
    features: Annotated[
        FloatArray, Variable("draw feature", FEATURE_UNITS, "checked features, without noise")
    ]
    end_diastolic_volume_ml: Annotated[
        FloatArray, Variable("draw", "mL", "largest cavity volume of the simulated beat")
    ]
    end_systolic_volume_ml: Annotated[
        FloatArray, Variable("draw", "mL", "smallest cavity volume of the simulated beat")
    ]
    isometric_stiffness_kpa: Annotated[
        FloatArray, Variable("draw", "kPa", "k_0 (1 - exp(-k_ATP D_T)), D_T the activation")
    ]
    failed: Annotated[
        int,
        Variable("", "1", "draws left out because their simulation failed", after="coverage_recording_noise"),
    ]

    @property
    def ejection_fraction(
        self,
    ) -> Annotated[
        FloatArray,
        Variable("draw", "1", "ejection fraction of the simulated beat", after="end_systolic_volume_ml"),
    ]:
        """Ejection fraction of the simulated beat; shape (n,)."""
        return 1.0 - self.end_systolic_volume_ml / self.end_diastolic_volume_ml


@dataclass(frozen=True)
class Target:
    """The observation that predictions are compared with.

    The volumes are from the subject's context; the end-systolic one conditions the posterior, the simulator
    does not see it. Stiffness and its standard error are NaN where the phase is missing.
    """

    grid: Annotated[
        FloatArray, Variable("grid", "1", "analysis phases, fraction of the cycle from the R peak")
    ]
    curve_kpa: Annotated[FloatArray, Variable("grid", "kPa", "observed curve")]
    phase: Annotated[FloatArray, Variable("phase", "1", "phases of the recording, fraction of the cycle")]
    measured: Annotated[BoolArray, Variable("phase", "1", "1 measured, 0 missing")]
    stiffness_kpa: Annotated[FloatArray, Variable("phase", "kPa", "observed stiffness")]
    stiffness_se_kpa: Annotated[
        FloatArray, Variable("phase", "kPa", "standard error of the observed stiffness")
    ]
    features: Annotated[
        FloatArray, Variable("feature", FEATURE_UNITS, "checked features of the observed curve")
    ]
    feature_names: Annotated[tuple[str, ...], Labels("feature")]
    feature_noise_sd: Annotated[FloatArray, Variable("feature", FEATURE_UNITS, "sd of the observation noise")]
    lvedv_ml: Annotated[float, Variable("", "mL", "measured end-diastolic volume")]
    lvesv_ml: Annotated[float, Variable("", "mL", "measured end-systolic volume")]


@dataclass(frozen=True)
class Prediction:
    """A predictive distribution (prior or posterior) and how it meets the observation.

    ``curve`` and ``scores`` are on the grid, ``phases`` at the phases of the recording, ``phase_scores`` at
    the measured ones; their intervals are those of noiseless curves in an experiment on features, of new
    recordings in one on speeds. ``observed`` is of curves as a new observation shows them, in either.
    ``coverages`` name the interval that each is of. ``features`` and ``coverage_recording_noise``
    include observation noise: stiffness plus Gaussian noise of the recording's standard error in the latter.
    """

    draws: Annotated[Draws, Part()]
    curve: Annotated[Band, Part("curve_{}_kpa", "grid", "kPa", words={"noise": ""})]
    phases: Annotated[Band, Part("phase_{}_kpa", "phase", "kPa", words={"noise": ""})]
    features: Annotated[FeatureCheck, Part(units=FEATURE_UNITS)]
    scores: Annotated[Scores, Part(words={"at": "on the grid", "after": "on the grid", "points": "grid"})]
    phase_scores: Annotated[
        Scores,
        Part(
            "phases_{}",
            words={"at": f"at the {MEASURED}", "after": MEASURED, "points": MEASURED},
        ),
    ]
    coverage_recording_noise: Annotated[
        float,
        Variable(
            "",
            "1",
            "fraction of the measured phases inside the interval of a new recording, noise included",
        ),
    ]
    observed: Annotated[
        Band,
        Part(
            "observed_{}_kpa",
            "grid",
            "kPa",
            words={"noise": " of curves as a new observation shows them, on the grid"},
        ),
    ]
    coverages: Annotated[Coverages, Part("coverage_{}", words={"points": "grid"})]
    phase_coverages: Annotated[Coverages, Part("phases_coverage_{}", words={"points": MEASURED})]


@dataclass(frozen=True)
class PredictiveCheck(Artefact, kind="predictive"):
    """The prior and the posterior predictive check of one subject.

    A subject whose posterior may not be read has a prediction of 0 draws, NaN throughout.
    """

    target: Annotated[Target, Part()]
    interval: Annotated[float, Variable("", "1", "probability mass of every interval")]
    may_be_read: Annotated[bool, Variable("", "1", "1 where the posterior may be read, else 0")]
    prior: Annotated[Prediction, Part(group="prior")]
    posterior: Annotated[Prediction, Part(group="posterior")]

    labels = {"parameter": list(THETA_NAMES)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> PredictiveCheck:
        """Return what the groups of a file hold."""
        observed = groups["/"]["features"].to_numpy()
        given = {f"{group}.features.observed": observed for group in ("prior", "posterior")}
        return from_groups(cls, groups, given)


@dataclass(frozen=True)
class FreePredictiveCheck(Artefact, kind="free_predictive"):
    """What prior and posterior predict of a free-running recording, and how its p pushes lie in it."""

    grid: Annotated[FloatArray, Variable("grid", "1", "analysis phases, fraction of the cycle")]
    prior: Annotated[Band, Part("prior_{}_kpa", "grid", "kPa", words={"noise": " of noiseless curves"})]
    posterior: Annotated[
        Band, Part("posterior_{}_kpa", "grid", "kPa", words={"noise": " of noiseless curves"})
    ]
    phase: Annotated[FloatArray, Variable("push", "1", "instants of the pushes, fraction of the beat")]
    stiffness_kpa: Annotated[FloatArray, Variable("push", "kPa", "observed stiffness 3 rho c_s^2")]
    relative_se: Annotated[FloatArray, Variable("push", "1", "standard error of each speed over it")]
    pushes: Annotated[
        Band, Part("push_{}_kpa", "push", "kPa", words={"noise": " of new pushes, errors included"})
    ]
    interval: Annotated[float, Variable("", "1", "probability mass of every interval")]
    coverage: Annotated[float, Variable("", "1", "share of the pushes inside the interval of new ones")]


class FeatureError(ValueError):
    """A feature to check that the summary does not have."""


@dataclass(frozen=True)
class CheckedFeatures:
    """The features that a check compares, by name, of those of a summary."""

    names: tuple[str, ...]
    summary: SummarySettings

    @property
    def columns(self) -> list[int]:
        """Where they stand in the summary; a name that it does not have is a FeatureError."""
        names = summary_names(self.summary)
        if unknown := [name for name in self.names if name not in names]:
            raise FeatureError(
                f"predictive.features: {unknown[0]!r} is no feature of the summary; it has {', '.join(names)}"
            )
        return [names.index(name) for name in self.names]

    def of(self, curve_kpa: FloatArray) -> FloatArray:
        """Return the features (n, features) of curves (n, grid)."""
        return summarise(curve_kpa, self.summary)[:, self.columns]

    def target(self, observation: Observation, se_kpa: FloatArray, noise_sd: FloatArray) -> Target:
        """Return what predictions are compared with.

        Standard errors of the stiffness are (phases,), standard deviations of the features (features,).
        """
        return Target(
            grid=observation.grid,
            curve_kpa=observation.curve_kpa,
            phase=observation.phase,
            measured=observation.measured,
            stiffness_kpa=observation.stiffness_kpa,
            stiffness_se_kpa=se_kpa,
            features=self.of(observation.curve_kpa[None])[0],
            feature_names=self.names,
            feature_noise_sd=noise_sd,
            lvedv_ml=observation.context.lvedv_ml,
            lvesv_ml=observation.context.lvesv_ml,
        )


@dataclass(frozen=True)
class Replicates:
    """n predictive draws, and a new recording of each: on the grid, at the phases, and its features.

    ``measured_kpa`` (n, phases) are values at the phases with the noise of the measurement alone; all else
    that is new has the noise of the experiment's observation model.
    """

    draws: Draws
    curve_kpa: FloatArray
    phase_kpa: FloatArray
    features: FloatArray
    measured_kpa: FloatArray


def predict(made: Replicates, target: Target, interval: float, *, of_new: bool) -> Prediction:
    """Compare predictive draws with the observation; without draws every score and band is NaN.

    Bands and scores have the intervals of new recordings if ``of_new``, else those of noiseless curves.
    """
    draws, measured, observed = made.draws, target.measured, target.stiffness_kpa[target.measured]
    curve, phases = band(draws.curve_kpa, interval), band(draws.phase_kpa, interval)
    new = band(made.curve_kpa, interval)
    if of_new:
        new_phases = band(made.phase_kpa, interval)
        curve = replace(curve, low=new.low, high=new.high)
        phases = replace(phases, low=new_phases.low, high=new_phases.high)
    at_phases = draws.phase_kpa[:, measured], made.phase_kpa[:, measured]
    alone = band(made.measured_kpa[:, measured], interval)
    return Prediction(
        draws=draws,
        curve=curve,
        phases=phases,
        features=FeatureCheck(target.features, band(made.features, interval)),
        scores=score(target.grid, target.curve_kpa, curve),
        phase_scores=score(target.phase[measured], observed, rows_of(phases, measured)),
        coverage_recording_noise=coverage(observed, alone) if len(draws.theta) else NO_SCORES.coverage,
        observed=new,
        coverages=cover(target.curve_kpa, draws.curve_kpa, made.curve_kpa, interval),
        phase_coverages=cover(observed, *at_phases, interval),
    )


def withheld(prediction: Prediction) -> Prediction:
    """Return the prediction of a subject whose posterior is not reported: curves, but no scores."""
    return replace(
        prediction,
        scores=NO_SCORES,
        phase_scores=NO_SCORES,
        coverage_recording_noise=NO_SCORES.coverage,
        coverages=NO_COVERAGES,
        phase_coverages=NO_COVERAGES,
    )


def log_scores(subject: str, check: PredictiveCheck) -> None:
    """Log the scores of a subject's check."""
    prior, posterior = check.prior.scores, check.posterior.scores
    if not check.may_be_read:
        LOGGER.info("subject %s: not to be read, no scores; prior RMSE %.2f kPa", subject, prior.rmse_kpa)
        return
    LOGGER.info(
        "subject %s: RMSE %.2f -> %.2f kPa, R2 %.3f, coverage of the grid by noiseless curves %.2f, "
        "with noise %.2f (prior without %.2f, its envelope %.2f), %d/%d features inside, %d draws failed",
        subject,
        prior.rmse_kpa,
        posterior.rmse_kpa,
        posterior.r2,
        check.posterior.coverages.noiseless,
        check.posterior.coverages.observed,
        check.prior.coverages.noiseless,
        check.prior.coverages.envelope,
        check.posterior.features.inside.sum(),
        len(check.target.feature_names),
        check.posterior.draws.failed,
    )

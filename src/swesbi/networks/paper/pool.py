"""The pooled training set of all subjects under the observation model of features (paper, Eqs. 4 to 7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from swesbi import artefacts
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.base.progress import LOGGER
from swesbi.context import CONTEXT_NAMES, CONTEXT_UNITS, Context
from swesbi.heart.prior_simulations import PriorSimulations, first_of
from swesbi.measurement.likelihood import MeasuredSubject, measured_subjects
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import (
    MeasurementSettings,
    SummarySettings,
    summary_names,
    summary_units,
)
from swesbi.networks.files import MIXED, Standardisation, fit_standardisation
from swesbi.networks.settings import ObservationModelSettings
from swesbi.parameters import THETA_COLUMNS, THETA_NAMES
from swesbi.recording.observation import Observation
from swesbi.seeds import generator


def noise_sd(names: Sequence[str], feature_noise_sd: Mapping[str, float]) -> FloatArray:
    """Return the noise's standard deviations (F,), in raw feature units, zero where none is named."""
    if unknown := sorted(set(feature_noise_sd) - set(names)):
        raise ValueError(
            f"feature_noise_sd: {', '.join(unknown)} is not a feature of this experiment's summary; "
            f"its features are {', '.join(names)}"
        )
    return np.array([feature_noise_sd.get(name, 0.0) for name in names])


def augment(features: FloatArray, sd: FloatArray, copies: int, rng: np.random.Generator) -> FloatArray:
    """Return N_aug ``copies`` x + epsilon of features (n, F), epsilon ~ N(0, diag(sd^2)) (paper, Eq. 5).

    Shape (n, copies, F). Only features with a positive sd consume random numbers.
    """
    noisy = np.flatnonzero(sd > 0.0)
    copied = np.repeat(features[:, None, :], copies, axis=1)
    copied[:, :, noisy] += sd[noisy] * rng.standard_normal((len(features), copies, len(noisy)))
    return copied


@dataclass(frozen=True)
class SubjectFeatures:
    """One subject's context c_d, prior draws with their noiseless features, and observed features, raw."""

    context: Context
    draw_index: IntArray
    theta: FloatArray  # (n, 3)
    features: FloatArray  # x_{d,n}, (n, F)
    observed: FloatArray  # x_obs,d, (F,)


@dataclass(frozen=True)
class Components:
    """Names and units of the C components of the conditioning vector: features, then context."""

    names: Annotated[tuple[str, ...], artefacts.Labels("component")]
    units: Annotated[tuple[str, ...], artefacts.Labels("component", "component_unit")]

    @property
    def features(self) -> tuple[str, ...]:
        """The names of the features alone."""
        return self.names[: -len(CONTEXT_NAMES)]


@dataclass(frozen=True)
class Pool(artefacts.Artefact, kind="pool"):
    """The training set, N rows, and the observed conditioning vectors of D subjects, C components.

    Parameters and conditioning vectors are in single precision, as training uses them.
    """

    components: Annotated[Components, artefacts.Part()]
    subjects: Annotated[tuple[str, ...], artefacts.Labels("subject")]
    theta: Annotated[
        NDArray[np.float32], artefacts.Variable("sample parameter", THETA_COLUMNS, "parameters of each row")
    ]
    z: Annotated[
        NDArray[np.float32],
        artefacts.Variable("sample component", "1", "standardised conditioning vector of each row"),
    ]
    subject_index: Annotated[
        NDArray[np.int16], artefacts.Variable("sample", "1", "position of the row's subject in `subject`")
    ]
    draw_index: Annotated[
        NDArray[np.int32],
        artefacts.Variable("sample", "1", "number of the row's prior draw within its subject"),
    ]
    standardisation: Annotated[Standardisation, artefacts.Part()]
    observed: Annotated[
        FloatArray, artefacts.Variable("subject component", MIXED, "observed features and context, raw")
    ]

    labels = {"parameter": list(THETA_NAMES)}

    @property
    def z_obs(
        self,
    ) -> Annotated[
        FloatArray, artefacts.Variable("subject component", "1", "standardised observed conditioning vector")
    ]:
        """The standardised observed conditioning vectors, shape (D, C), without noise (paper, Eq. 6)."""
        return self.standardisation.apply(self.observed)

    def observed_z(self, subject: str) -> FloatArray:
        """Return one subject's z_obs of shape (C,)."""
        if subject not in self.subjects:
            raise KeyError(f"the pool holds no subject {subject!r}; it holds {', '.join(self.subjects)}")
        return np.asarray(self.z_obs[self.subjects.index(subject)])

    def check_components(self, names: tuple[str, ...], given: str) -> None:
        """Refuse a network whose inputs have other names or another order; it is ``given`` under a name."""
        if names != self.components.names:
            known = ", ".join(self.components.names)
            raise artefacts.UnfitError(
                given, f"takes the components {', '.join(names)}; the pool holds {known}. Train on this pool"
            )


def components_of(feature_names: Sequence[str], feature_units: Sequence[str]) -> Components:
    """Put the context's names and units behind the features'."""
    return Components((*feature_names, *CONTEXT_NAMES), (*feature_units, *CONTEXT_UNITS))


def with_context(features: FloatArray, context: Context) -> FloatArray:
    """Put the context behind features of shape (n, F): raw conditioning vectors of shape (n, F + 7)."""
    repeated = np.broadcast_to(context.as_array(), (len(features), len(CONTEXT_NAMES)))
    return np.concatenate([features, repeated], axis=1)


def build_pool(
    subjects: Sequence[SubjectFeatures],
    components: Components,
    settings: ObservationModelSettings,
    seed: int,
) -> Pool:
    """Augment, concatenate and standardise the simulations of all subjects.

    Rows run over subjects, then draws, then augmentations. The noise of one subject comes from a
    stream of its own, so it depends neither on the other subjects nor on how draws were sharded.
    """
    sd = noise_sd(components.features, settings.feature_noise_sd)
    for subject in subjects:
        _check_finite(subject, components.features)
    raw = np.concatenate([_raw_rows(subject, sd, settings.augmentations, seed) for subject in subjects])
    standardisation = fit_standardisation(raw)
    copies = settings.augmentations
    counts = [len(subject.theta) * copies for subject in subjects]
    return Pool(
        components=components,
        standardisation=standardisation,
        subjects=tuple(subject.context.subject for subject in subjects),
        theta=np.concatenate([np.repeat(s.theta, copies, axis=0) for s in subjects]).astype(np.float32),
        z=standardisation.apply(raw).astype(np.float32),
        subject_index=np.repeat(np.arange(len(subjects), dtype=np.int16), counts),
        draw_index=np.concatenate([np.repeat(s.draw_index, copies) for s in subjects]).astype(np.int32),
        observed=np.stack([np.concatenate([s.observed, s.context.as_array()]) for s in subjects]),
    )


def _raw_rows(subject: SubjectFeatures, sd: FloatArray, copies: int, seed: int) -> FloatArray:
    """Return one subject's noisy features and context, shape (n * copies, C), in raw units."""
    rng = generator(seed, "feature noise", subject.context.subject)
    noisy = augment(subject.features, sd, copies, rng).reshape(-1, len(sd))
    return with_context(noisy, subject.context)


def _check_finite(subject: SubjectFeatures, names: tuple[str, ...]) -> None:
    for what, values in (("simulation", subject.features), ("observation", subject.observed[None])):
        rows, columns = np.nonzero(~np.isfinite(values))
        if rows.size:
            raise ValueError(
                f"subject {subject.context.subject}: feature {names[columns[0]]} of {what} {rows[0]} is "
                f"{values[rows[0], columns[0]]}; check that subject's recording, passive baseline and shards"
            )


def pool_of_features(
    observations: tuple[Observation, ...],
    passives: BySubject[PassiveBaseline],
    shards: BySubject[PriorSimulations],
    *,
    simulations_per_subject: int,
    measurement: MeasurementSettings,
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
    seed: int,
) -> Pool:
    """Pool the noise-augmented, standardised features and contexts of all subjects (paper, Eq. 7).

    The first simulations of each subject are taken.

    Raises:
        UnfitError: A subject lacks a passive baseline or enough simulations.
        ValueError: A feature is not finite, or a noise is named for an unknown one.
    """
    subjects = measured_subjects(observations, passives, measurement)
    components = components_of(summary_names(summary), summary_units(summary))
    features = [
        _features(subject, first_of(shards, subject.observation.subject, simulations_per_subject), summary)
        for subject in subjects
    ]
    pool = build_pool(features, components, observation_model, seed)
    LOGGER.info("pool: %d subjects, %d rows of %d components", len(subjects), *pool.z.shape)
    return pool


def _features(
    subject: MeasuredSubject, simulations: PriorSimulations, summary: SummarySettings
) -> SubjectFeatures:
    return SubjectFeatures(
        context=subject.observation.context,
        draw_index=simulations.draw_index,
        theta=simulations.theta,
        features=subject.simulated_features(
            simulations.cycle_phase, simulations.active_stiffness_kpa, summary
        ),
        observed=subject.observed_features(summary),
    )

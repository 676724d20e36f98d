"""The noise of the measured speeds, estimated from the repeats of a cohort, by group; standard errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Protocol

import numpy as np
import xarray as xr
from scipy.special import chdtrc

from swesbi import artefacts
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.recording import components, sweeps
from swesbi.recording.components import (
    ComponentEstimate,
    RepeatLevels,
    check_levels,
    fit_components,
    joined,
    log_restricted_likelihood,
)
from swesbi.recording.settings import OTHERS
from swesbi.recording.speed import NoiseComponents
from swesbi.recording.sweeps import (
    SweepLevels,
    fit_sweeps,
    joined_sweeps,
    log_restricted_likelihood_of_sweeps,
)

VALUES: Final = artefacts.schema_of(ComponentEstimate)["/"]
POOLED: Final = artefacts.Part(
    along="group component",
    words={"whose": "common to a group", "none": ", NaN at zero", "kind": "profile-likelihood "},
)
OWN: Final = artefacts.Part(
    "subject_{}", "subject component", words={"whose": "of one recording alone", "none": "", "kind": ""}
)


@dataclass(frozen=True)
class NoiseEstimate:
    """The components, from so many repeats and samples.

    Attributes:
        repeat: Between repeats, common to the samples of one.
        sample: Between the spatial samples of a repeat.
        repeats: Over the phases.
        samples: Of all repeats.
        sweep: Between sweeps, common to the phases of one; None where repeats are separate.
    """

    repeat: ComponentEstimate
    sample: ComponentEstimate
    repeats: Annotated[int, artefacts.Variable("", "1", "repeats with accepted samples")]
    samples: Annotated[int, artefacts.Variable("", "1", "accepted samples")]
    sweep: ComponentEstimate | None = None

    @property
    def parts(self) -> dict[str, ComponentEstimate]:
        """The components by what they are between."""
        known = {"repeat": self.repeat, "sample": self.sample}
        return known if self.sweep is None else known | {"sweep": self.sweep}

    @property
    def components(self) -> NoiseComponents:
        """The components alone."""
        return NoiseComponents(**{f"{name}_fraction": part.fraction for name, part in self.parts.items()})


@dataclass(frozen=True)
class GroupNoise:
    """Relative standard deviations of the speed over a group of recordings.

    Attributes:
        pooled: Components common to all of them.
        by_subject: Those of each recording alone, NaN where it does not tell them; for comparison alone.
        homogeneity_p: By the likelihood ratio; NaN for one recording.
    """

    pooled: NoiseEstimate
    by_subject: Mapping[str, NoiseEstimate]
    homogeneity_p: Annotated[
        float, artefacts.Variable("group", "1", "p-value: all recordings share their components")
    ]


@dataclass(frozen=True)
class CohortNoise:
    """The noise of a cohort: of each group that its ``recording.yaml`` declares, or of all recordings.

    Attributes:
        groups: By name.
        interval: Of all intervals.
    """

    groups: Mapping[str, GroupNoise]
    interval: Annotated[float, artefacts.Variable("", "1", "mass of the intervals")]

    @property
    def usual(self) -> NoiseComponents:
        """The components of the recordings that no declared group names, or of the first group."""
        return self.groups.get(OTHERS, next(iter(self.groups.values()))).pooled.components

    @property
    def group_of(self) -> dict[str, str]:
        """The group of each subject, in the order of the groups."""
        return {name: group for group, noise in self.groups.items() for name in noise.by_subject}

    def of(self, subject: str) -> NoiseComponents:
        """Return the components of a subject's group.

        Raises:
            ArtefactError: The cohort has no such subject.
        """
        if subject not in self.group_of:
            known = ", ".join(self.group_of)
            raise artefacts.ArtefactError(f"the noise of {subject} is not known; it is of {known}")
        return self.groups[self.group_of[subject]].pooled.components


def fit_cohort(
    recordings: Mapping[str, RepeatLevels], groups: Mapping[str, str], interval: float = 0.9
) -> CohortNoise:
    """Fit the noise of each group of a cohort by itself, as :func:`fit_noise` does.

    Args:
        recordings: Repeats of each subject's recording, by subject.
        groups: The group of each subject that a group names; the rest are ``OTHERS``.
        interval: Mass of the profile-likelihood intervals.

    Raises:
        ValueError: As of :func:`fit_noise`.
    """
    apart: dict[str, dict[str, RepeatLevels]] = {}
    for subject, levels in recordings.items():
        apart.setdefault(groups.get(subject, OTHERS), {})[subject] = levels
    return CohortNoise({name: fit_noise(own, interval) for name, own in apart.items()}, interval)


def fit_noise(recordings: Mapping[str, RepeatLevels], interval: float = 0.9) -> GroupNoise:
    """Fit a mixed model to the log speeds of recordings by REML.

    Every phase of every subject has a mean of its own (fixed), repeats and samples are random, and so are
    sweeps where repeats are such; the components, c of them, are common to all. Sharing them is tested by the
    likelihood ratio against a fit of each recording, chi-squared with c (subjects - 1) degrees of freedom;
    with three sweeps a recording that is somewhat too small a p-value.

    Args:
        recordings: Repeats of each subject's recording, by subject; of all or of none known as sweeps.
        interval: Mass of the profile-likelihood intervals.

    Raises:
        ValueError: There is no recording, or only some are of sweeps, or all do not tell a component.
    """
    if not recordings:
        raise ValueError("there is no recording to estimate noise from")
    try:
        pooled, top = _fit(together(tuple(recordings.values())), interval)
    except ValueError as error:
        who = "all subjects" if len(recordings) > 1 else next(iter(recordings))
        raise ValueError(f"{who}: {error}") from None
    fits = {name: _fit_alone(levels, interval) for name, levels in recordings.items()}
    told = {name: levels for name, levels in recordings.items() if np.isfinite(fits[name][1])}
    freedom = len(pooled.parts) * (len(told) - 1)
    if len(told) < len(fits) and freedom > 0:
        top = _fit(together(tuple(told.values())), interval)[1]
    ratio = 2.0 * (sum(fits[name][1] for name in told) - top)
    p_value = float(chdtrc(freedom, max(ratio, 0.0))) if freedom > 0 else float(np.nan)
    by_subject = {name: estimate for name, (estimate, _) in fits.items()}
    return GroupNoise(pooled, by_subject, p_value)


def check_together(recordings: Sequence[RepeatLevels]) -> None:
    """Refuse recordings that do not tell their noise together.

    Raises:
        ValueError: Only some are of sweeps, or all together do not tell a component.
    """
    check_levels(together(recordings))


def together(recordings: Sequence[RepeatLevels]) -> RepeatLevels:
    """Join recordings, at least one.

    Raises:
        ValueError: Only some are of sweeps.
    """
    sweeps = [levels for levels in recordings if isinstance(levels, SweepLevels)]
    if sweeps and len(sweeps) < len(recordings):
        raise ValueError(f"{len(sweeps)} of {len(recordings)} recordings are of sweeps: estimate them apart")
    return joined_sweeps(sweeps) if sweeps else joined(recordings)


def _fit_alone(levels: RepeatLevels, interval: float) -> tuple[NoiseEstimate, float]:
    """Return the components of one recording and the maximum of its likelihood; NaN where it cannot."""
    try:
        return _fit(levels, interval)
    except ValueError:
        none = ComponentEstimate(np.nan, np.nan, np.nan, np.nan)
        sweep = none if isinstance(levels, SweepLevels) else None
        return NoiseEstimate(none, none, levels.repeats, levels.samples, sweep), np.nan


def _fit(levels: RepeatLevels, interval: float) -> tuple[NoiseEstimate, float]:
    """Return the components and the maximum of the likelihood, by the model that the repeats call for."""
    sweep: ComponentEstimate | None = None
    if isinstance(levels, SweepLevels):
        repeat, sample, sweep, top = fit_sweeps(levels, interval)
    else:
        repeat, sample, top = fit_components(levels, interval)
    return NoiseEstimate(repeat, sample, levels.repeats, levels.samples, sweep), top


class NoiseFractions(Protocol):
    """Anything with relative standard deviations: of a cohort or of one recording."""

    @property
    def repeat_fraction(self) -> float:
        """Relative standard deviation between repeats."""

    @property
    def sample_fraction(self) -> float:
        """Relative standard deviation between samples of a repeat."""

    @property
    def sweep_fraction(self) -> float:
        """Relative standard deviation between sweeps; 0 where repeats are separate."""


def relative_se(samples_by_repeat: IntArray, noise: NoiseFractions) -> FloatArray:
    """Return the standard error of each phase's mean speed as a fraction of it; shape (p,).

    The mean is over repeat means, so with R repeats of n_r accepted samples it is
    sqrt(sum_r (s_rep^2 + s_swp^2 + s_sam^2 / n_r)) / R; repeats without an accepted sample do not count.
    What the means of several phases share, where repeats are sweeps, is in :func:`mean_errors`.

    Args:
        samples_by_repeat: Accepted samples of each repeat; shape (p, repeats).
        noise: The components.

    Returns:
        NaN at phases without an accepted sample.
    """
    counted = samples_by_repeat > 0
    of_repeat = noise.repeat_fraction**2 + noise.sweep_fraction**2
    per_repeat = of_repeat + noise.sample_fraction**2 / np.maximum(samples_by_repeat, 1)
    repeats = counted.sum(axis=1)
    variance = np.where(counted, per_repeat, 0.0).sum(axis=1)
    return np.where(repeats > 0, np.sqrt(variance) / np.maximum(repeats, 1), np.nan)


@dataclass(frozen=True)
class MeanErrors:
    """Errors of a recording's mean log speeds at p phases, from K sweeps; or of n recordings, (n, ...).

    Attributes:
        own: Standard deviation of what each mean has for itself; shape (p,).
        shared: Factor W of what they share; shape (p, K), with K = 0 where repeats are separate.
    """

    own: FloatArray
    shared: FloatArray

    @classmethod
    def separate(cls, own: FloatArray) -> MeanErrors:
        """Return errors that share nothing."""
        return cls(own, np.empty((*own.shape, 0)))

    @property
    def total(self) -> FloatArray:
        """Standard error of each mean, sqrt(own^2 + sum_k W_k^2); shape (p,)."""
        return np.asarray(np.sqrt(self.own**2 + (self.shared**2).sum(axis=-1)))

    @property
    def covariance(self) -> FloatArray:
        """The covariance of the means of one recording, diag(own^2) + shared shared^T; shape (p, p)."""
        return np.diag(self.own**2) + self.shared @ self.shared.T


def mean_errors(samples_by_repeat: IntArray, noise: NoiseFractions) -> MeanErrors:
    """Return the errors of each phase's mean speed, those apart that all phases of a sweep share.

    The mean at phase i weighs its R_i repeats with accepted samples by W_ir = 1 / R_i, the others by 0. With
    log speeds mu_i + v_r + u_ir + e_irj (``sweeps``) the means have, to first order in the errors,
    the covariance

        diag(d^2) + s_swp^2 W W^T,    d_i^2 = sum_{r in i} (s_rep^2 + s_sam^2 / n_ir) / R_i^2

    (of linear combinations of random effects: Searle, Casella and McCulloch 1992, Ch. 6).
    It is exact in W: a sweep that misses a phase shares nothing with it. Where all phases have the same R
    repeats, s_swp^2 W W^T is s_swp^2 / R in every place, of rank one.

    Args:
        samples_by_repeat: Accepted samples of each repeat; shape (p, K). A column is one sweep.
        noise: The components.

    Returns:
        NaN at phases without an accepted sample.
    """
    own = relative_se(samples_by_repeat, NoiseComponents(noise.repeat_fraction, noise.sample_fraction))
    if noise.sweep_fraction == 0.0:
        return MeanErrors.separate(own)
    counted = (samples_by_repeat > 0).astype(np.float64)
    repeats = counted.sum(axis=1, keepdims=True)
    weights = np.where(repeats > 0.0, counted / np.maximum(repeats, 1.0), np.nan)
    return MeanErrors(own, noise.sweep_fraction * weights)


@dataclass(frozen=True)
class NoiseComparison:
    """One recording's noise beside the cohort's.

    Attributes:
        own: REML components of the recording alone.
        statistic: Likelihood ratio, twice the log of it.
        p_value: Of the ratio, chi-squared with as many degrees of freedom as there are components.
    """

    own: NoiseComponents
    statistic: float
    p_value: float


def compare_noise(levels: RepeatLevels, cohort: NoiseComponents) -> NoiseComparison:
    """Test by the restricted likelihood ratio that a recording has the cohort's components.

    The cohort's own uncertainty is left out, as it is where its components give the standard errors.

    Args:
        levels: Repeats of the recording.
        cohort: The cohort's components.

    Returns:
        NaN where the recording does not tell a component.
    """
    try:
        own, top = _likeliest(levels)
    except ValueError:
        return NoiseComparison(NoiseComponents(np.nan, np.nan), np.nan, np.nan)
    ratio = max(0.0, 2.0 * (top - log_likelihood_of_noise(levels, cohort)))
    number = 3 if isinstance(levels, SweepLevels) else 2  # of components
    return NoiseComparison(own, ratio, float(chdtrc(number, ratio)))


def _likeliest(levels: RepeatLevels) -> tuple[NoiseComponents, float]:
    """Return the components of the highest likelihood, and how high it is.

    Raises:
        ValueError: A component cannot be told.
    """
    if isinstance(levels, SweepLevels):
        variances, top = sweeps.maximum(levels)
        return NoiseComponents(*sweeps.as_deviations(variances)), top
    (repeat, sample), top = components.maximum(levels)
    return NoiseComponents(repeat, sample), top


def log_likelihood_of_noise(levels: RepeatLevels, noise: NoiseComponents) -> float:
    """Return the restricted log likelihood of components, by the model that the repeats call for."""
    if isinstance(levels, SweepLevels):
        return log_restricted_likelihood_of_sweeps(
            levels, noise.repeat_fraction, noise.sample_fraction, noise.sweep_fraction
        )
    separate = noise.of_separate_repeats
    return log_restricted_likelihood(levels, separate.repeat_fraction, separate.sample_fraction)


COUNTS: Final = artefacts.schema_of(NoiseEstimate)["/"]
SCHEMA: Final = {
    "component": artefacts.Variable("component", "1", "between repeats, samples of a repeat, sweeps if any"),
    "group": artefacts.Variable("group", "1", "groups of recordings whose noise is estimated together"),
    "subject": artefacts.Variable("subject", "1", "subjects of the cohort"),
    "subject_group": artefacts.Variable("subject", "1", "group of the recording", text=True),
    **POOLED.place_all(VALUES),
    **artefacts.Part("{}", "group").place_all(COUNTS),
    **OWN.place_all(VALUES),
    **artefacts.Part("subject_{}", "subject").place_all(COUNTS),
    **artefacts.schema_of(GroupNoise)["/"],
    **artefacts.schema_of(CohortNoise)["/"],
}
KIND: Final = artefacts.register("noise", {"/": SCHEMA})


def to_dataset(noise: CohortNoise) -> xr.Dataset:
    """Return the artefact's content; subjects in the order of the groups."""
    groups = tuple(noise.groups.values())
    pooled = tuple(group.pooled for group in groups)
    alone = tuple(own for group in groups for own in group.by_subject.values())
    values: dict[str, Any] = {name: _table(pooled, name) for name in VALUES}
    values |= {f"subject_{name}": _table(alone, name) for name in VALUES}
    values |= {name: np.array([getattr(each, name) for each in pooled]) for name in COUNTS}
    values |= {f"subject_{name}": np.array([getattr(each, name) for each in alone]) for name in COUNTS}
    values |= {
        "component": list(pooled[0].parts),
        "group": list(noise.groups),
        "subject": list(noise.group_of),
        "subject_group": list(noise.group_of.values()),
        "homogeneity_p": np.array([group.homogeneity_p for group in groups]),
    }
    return artefacts.build_dataset(SCHEMA, values | artefacts.values_of(noise)["/"])


def read_noise(path: Path) -> CohortNoise:
    """Read the noise of a cohort.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    data, _ = artefacts.load(path, KIND)
    names = [name for name in data if str(name).startswith("subject_") and name != "subject_group"]
    subjects = data[names].rename({name: str(name).removeprefix("subject_") for name in names})
    alone = {
        str(name): (str(group), _estimate(subjects.isel(subject=index)))
        for index, (name, group) in enumerate(
            zip(subjects["subject"].to_numpy(), data["subject_group"].to_numpy(), strict=True)
        )
    }
    groups = {
        str(group): GroupNoise(
            pooled=_estimate(data.isel(group=index)),
            by_subject={name: own for name, (of, own) in alone.items() if of == group},
            homogeneity_p=float(data["homogeneity_p"][index]),
        )
        for index, group in enumerate(data["group"].to_numpy())
    }
    return artefacts.from_dataset(CohortNoise, data, groups=groups)


def _table(estimates: Sequence[NoiseEstimate], name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([[getattr(part, name) for part in estimate.parts.values()] for estimate in estimates])


def _estimate(data: xr.Dataset) -> NoiseEstimate:
    rows = artefacts.from_rows(ComponentEstimate, data, "component")
    parts = dict(zip(map(str, data["component"].to_numpy()), rows, strict=True))
    return artefacts.from_dataset(NoiseEstimate, data, **parts)

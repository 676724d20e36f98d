"""The noise of the measured speeds, estimated from the repeats of a cohort, by group, or of one folder.

Of a folder the estimate is shrunk towards what is expected: the components have log-normal priors. With the
restricted likelihood of all repeats these give the most probable components. Of many recordings the data
decide, of one recording what its repeats do not tell is as the prior has it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, Final

import numpy as np
from scipy.special import chdtrc

from swesbi import artefacts
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import FloatArray
from swesbi.recording.noise.components import ComponentEstimate, RepeatLevels
from swesbi.recording.noise.sweeps import SweepLevels
from swesbi.recording.settings import OTHERS, NoisePriorSettings
from swesbi.recording.speed import NoiseComponents

VALUES: Final = artefacts.schema_of(ComponentEstimate)["/"]
POOLED: Final = artefacts.Part(
    along="group component",
    words={"whose": "common to a group", "none": ", NaN at zero", "kind": "profile-likelihood "},
)
OWN: Final = artefacts.Part(
    "subject_{}", "subject component", words={"whose": "of one recording alone", "none": "", "kind": ""}
)
LIMITS: Final = (1.0e-4, 0.5)
"""Of a component; a search that ends there is one in which nothing was measured."""
MANY: Final = 20
"""Recordings of which one moves the estimate of a component by a few per cent at most."""


@dataclass(frozen=True)
class NoiseEstimate:
    """The components, from so many repeats and samples; no sweeps where repeats are separate."""

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

    ``by_subject`` has those of each recording alone, for comparison, NaN where it does not tell them. The
    p-value is by the likelihood ratio, NaN for one recording.
    """

    pooled: NoiseEstimate
    by_subject: Mapping[str, NoiseEstimate]
    homogeneity_p: Annotated[
        float, artefacts.Variable("group", "1", "p-value: all recordings share their components")
    ]


@dataclass(frozen=True)
class CohortNoise(artefacts.Artefact, kind="noise"):
    """The noise of a cohort: of each group that its ``recording.yaml`` declares, or of all recordings."""

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
        """Return the components of a subject's group; the cohort must have the subject."""
        if subject not in self.group_of:
            known = ", ".join(self.group_of)
            raise artefacts.ArtefactError(f"the noise of {subject} is not known; it is of {known}")
        return self.groups[self.group_of[subject]].pooled.components

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": SCHEMA}

    @classmethod
    def required_labels(cls) -> tuple[artefacts.Labels, ...]:
        """Return none: names of components, groups and subjects are datasets of the schema."""
        return ()

    def to_groups(self) -> dict[str, artefacts.Group]:
        """Return the content of the file; subjects in the order of the groups."""
        groups = tuple(self.groups.values())
        pooled = tuple(group.pooled for group in groups)
        alone = tuple(own for group in groups for own in group.by_subject.values())
        values: dict[str, Any] = {name: _table(pooled, name) for name in VALUES}
        values |= {f"subject_{name}": _table(alone, name) for name in VALUES}
        values |= {name: np.array([getattr(each, name) for each in pooled]) for name in COUNTS}
        values |= {f"subject_{name}": np.array([getattr(each, name) for each in alone]) for name in COUNTS}
        values |= {
            "component": list(pooled[0].parts),
            "group": list(self.groups),
            "subject": list(self.group_of),
            "subject_group": list(self.group_of.values()),
            "homogeneity_p": np.array([group.homogeneity_p for group in groups]),
        }
        return {"/": artefacts.build_group(SCHEMA, values | artefacts.values_of(self)["/"])}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, artefacts.Group], made: artefacts.Provenance) -> CohortNoise:
        """Return what the group of a file holds."""
        data = groups["/"]
        own = {
            name.removeprefix("subject_"): array
            for name, array in data.items()
            if name.startswith("subject_") and name != "subject_group"
        }
        subjects = artefacts.Group({**own, "component": data["component"]})
        pairs = zip(data["subject"].values, data["subject_group"].values, strict=True)
        alone = {
            str(name): (str(group), _estimate(subjects.at("subject", index)))
            for index, (name, group) in enumerate(pairs)
        }
        found = {
            str(group): GroupNoise(
                pooled=_estimate(data.at("group", index)),
                by_subject={name: one for name, (of, one) in alone.items() if of == group},
                homogeneity_p=float(data["homogeneity_p"].values[index]),
            )
            for index, group in enumerate(data["group"].values)
        }
        return artefacts.from_groups(cls, groups, {"groups": found})


def fit_cohort(
    recordings: Mapping[str, RepeatLevels], groups: Mapping[str, str], interval: float = 0.9
) -> CohortNoise:
    """Fit the noise of each group of a cohort by itself, as :func:`fit_noise` does.

    Subjects that no group names are of ``OTHERS``; ``interval`` is the mass of the profile-likelihood
    intervals.
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
    with three sweeps a recording that is somewhat too small a p-value. A ``ValueError`` says which component
    all recordings together do not tell.
    """
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


def together(recordings: Sequence[RepeatLevels]) -> RepeatLevels:
    """Join recordings, at least one; a ``ValueError`` where only some are of sweeps."""
    sweeps = [levels for levels in recordings if isinstance(levels, SweepLevels)]
    if sweeps and len(sweeps) < len(recordings):
        raise ValueError(f"{len(sweeps)} of {len(recordings)} recordings are of sweeps: estimate them apart")
    return SweepLevels.joined(sweeps) if sweeps else RepeatLevels.joined(recordings)


def _fit_alone(levels: RepeatLevels, interval: float) -> tuple[NoiseEstimate, float]:
    """Return the components of one recording and the maximum of its likelihood; NaN where it cannot."""
    try:
        return _fit(levels, interval)
    except ValueError:
        none = dict.fromkeys(levels.names, ComponentEstimate(np.nan, np.nan, np.nan, np.nan))
        return NoiseEstimate(repeats=levels.repeats, samples=levels.samples, **none), np.nan


def _fit(levels: RepeatLevels, interval: float) -> tuple[NoiseEstimate, float]:
    """Return the components and the maximum of the likelihood, by the model that the repeats call for."""
    parts, top = levels.estimates(interval)
    return NoiseEstimate(repeats=levels.repeats, samples=levels.samples, **parts), top


@dataclass(frozen=True)
class NoiseComparison:
    """One recording's noise beside the cohort's: its own REML components, and the likelihood ratio.

    The statistic is twice the log of the ratio; its p-value is by chi-squared, one degree a component.
    """

    own: NoiseComponents
    statistic: float
    p_value: float


def compare_noise(levels: RepeatLevels, cohort: NoiseComponents) -> NoiseComparison:
    """Test by the restricted likelihood ratio that a recording has the cohort's components.

    NaN where the recording does not tell a component. The cohort's own uncertainty is left out, as it is
    where its components give the standard errors.
    """
    try:
        own, top = levels.maximum
    except ValueError:
        return NoiseComparison(NoiseComponents(np.nan, np.nan), np.nan, np.nan)
    ratio = max(0.0, 2.0 * (top - levels.log_likelihood(cohort)))
    return NoiseComparison(own, ratio, float(chdtrc(len(levels.names), ratio)))


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


def _table(estimates: Sequence[NoiseEstimate], name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([[getattr(part, name) for part in estimate.parts.values()] for estimate in estimates])


def _estimate(data: artefacts.Group) -> NoiseEstimate:
    rows = artefacts.from_rows(ComponentEstimate, data, "component")
    parts = dict(zip(map(str, data["component"].to_numpy()), rows, strict=True))
    return artefacts.from_groups(NoiseEstimate, {"/": data}, parts)


@dataclass(frozen=True)
class FolderNoise:
    """The most probable noise of so many recordings of one kind of repeats; of none: the prior's medians."""

    components: NoiseComponents
    recordings: int

    @property
    def in_words(self) -> str:
        """The components, and what they are estimated from."""
        own = self.components
        parts = f"{own.repeat_fraction:.1%} between repeats, {own.sample_fraction:.1%} between samples"
        if own.sweep_fraction:
            parts += f", {own.sweep_fraction:.1%} between sweeps"
        if self.recordings == 0:
            return f"{parts}: as is expected of a laboratory that nobody has seen"
        few = "one recording and typical values together" if self.recordings == 1 else ""
        return f"{parts}: of {few or f'{self.recordings} recordings of the folder'}"


def folder_noise(recordings: Sequence[RepeatLevels], prior: NoisePriorSettings) -> FolderNoise:
    """Return the noise of a folder: the mode of prior times restricted likelihood, over log components.

    Its recordings are all of sweeps or none.
    """
    if not recordings:
        return FolderNoise(_median(prior), 0)
    from scipy.optimize import minimize

    levels = together(recordings)
    centre = np.log(list(vars(_median(prior)).values())[: len(levels.names)])

    def surprise(log_sd: FloatArray) -> float:
        distance = (log_sd - centre) / prior.log_sd
        noise = NoiseComponents(*np.exp(log_sd).tolist())
        return float(0.5 * distance @ distance - levels.log_likelihood(noise))

    bounds = [tuple(np.log(LIMITS))] * len(centre)
    found = minimize(surprise, centre, method="L-BFGS-B", bounds=bounds, options={"ftol": 1.0e-12})
    return FolderNoise(NoiseComponents(*np.exp(found.x).tolist()), len(recordings))


def _median(prior: NoisePriorSettings) -> NoiseComponents:
    return NoiseComponents(prior.repeat_fraction, prior.sample_fraction, prior.sweep_fraction)


@dataclass(frozen=True)
class FolderRecordings:
    """The repeats of a folder's recordings, by subject, with the noise that they have together.

    ``groups`` has the group of each subject whose noise is estimated apart.
    """

    levels: Mapping[str, RepeatLevels]
    prior: NoisePriorSettings
    groups: Mapping[str, str] = field(default_factory=dict)

    def noise(self, subject: str) -> FolderNoise:
        """Return the noise of all recordings of the subject's group and kind of repeats, its own too."""
        return self._by_kind[self._kind(subject)]

    @cached_property
    def _by_kind(self) -> dict[tuple[str, bool], FolderNoise]:
        """The noise of each group's sweeps, and of its separate repeats."""
        kinds = dict.fromkeys(map(self._kind, self.levels))
        return {kind: folder_noise(self._of_kind(kind), self.prior) for kind in kinds}

    def _kind(self, subject: str) -> tuple[str, bool]:
        return self.groups.get(subject, OTHERS), isinstance(self.levels[subject], SweepLevels)

    def _of_kind(self, kind: tuple[str, bool], but: str = "") -> list[RepeatLevels]:
        return [own for name, own in self.levels.items() if name != but and self._kind(name) == kind]

    def compared(self, subject: str) -> NoiseComparison | None:
        """Test by the restricted likelihood ratio that a recording has the noise of the others, if any.

        The ratio is that of two sets of components to one. Where the others are ``MANY``, one recording
        hardly moves what is estimated from all, and all stand for them.
        """
        own, noise = self.levels[subject], self.noise(subject)
        if noise.recordings < 2:
            return None
        alone = compare_noise(own, noise.components)
        if noise.recordings > MANY:
            return alone
        others = self._of_kind(self._kind(subject), but=subject)
        apart, rest = folder_noise(others, self.prior).components, together(others)
        gained = rest.log_likelihood(apart) - rest.log_likelihood(noise.components)
        ratio = alone.statistic + max(0.0, 2.0 * gained)
        return NoiseComparison(alone.own, ratio, float(chdtrc(len(own.names), ratio)))

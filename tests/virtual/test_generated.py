from __future__ import annotations

from functools import cache

import numpy as np
from speed_case import settings, shipped

from swesbi.recording.settings import ContextRow
from swesbi.virtual.generated import PHYSIOLOGY, GeneratedSubject, draw_volunteer, generate_cohort
from swesbi.virtual.volunteers import VOLUNTEERS


@cache
def cohort(count: int) -> tuple[GeneratedSubject, ...]:
    config = shipped()
    return generate_cohort(
        count, settings().prior.theta, config.acquisition, config.recording, 100, config.seed
    )


def test_a_generated_cohort_of_sweeps_has_noise_of_sweeps() -> None:
    config = shipped()
    protocol = config.acquisition.model_copy(update={"sweep_fraction": 0.05})
    subjects = generate_cohort(3, settings().prior.theta, protocol, config.recording, 100, config.seed)
    shared = np.mean([(one.recording.shared**2).sum(axis=1).mean() for one in subjects])
    assert 0.005 < np.sqrt(shared) < 0.06  # 0.05 / sqrt(3), of nine sweeps
    assert all(one.recording.shared.shape == (len(one.recording.phase), 3) for one in subjects)


def test_generated_subjects_are_healthy_hearts_of_their_own() -> None:
    config, prior = shipped(), settings().prior.theta
    volunteers = [draw_volunteer(i, prior, config.acquisition, np.random.default_rng(i)) for i in range(40)]
    for volunteer in volunteers:
        row = {name: getattr(volunteer.context, name) for name in ContextRow.model_fields}
        assert ContextRow.from_plain(row).to_context() == volunteer.context
    assert {one.context.sex for one in volunteers} == {"F", "M"}
    for name, (low, high) in PHYSIOLOGY.items():
        drawn = np.array([getattr(one, name) for one in volunteers])
        assert low <= drawn.min() < low + 0.2 * (high - low) < high - 0.2 * (high - low) < drawn.max() <= high
        of_g_and_h = [getattr(one, name) for one in VOLUNTEERS if one.model_version == 3]
        assert low <= min(of_g_and_h) <= max(of_g_and_h) <= high, name


def test_the_generated_cohort_is_recorded_and_none_of_the_study() -> None:
    small, large = cohort(2), cohort(3)
    for one, other in zip(small, large, strict=False):  # a larger cohort begins with the smaller one
        np.testing.assert_array_equal(one.theta, other.theta)
        np.testing.assert_array_equal(one.recording.speed_m_s, other.recording.speed_m_s)
    contexts = {one.context for one in VOLUNTEERS}
    for subject in large:
        assert subject.recording.context not in contexts
        assert subject.recording.subject not in "ABCDEF"
        assert 0.016 < subject.recording.errors.total.mean() < 0.029

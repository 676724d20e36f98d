from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from inference_case import CONTEXTS, FEATURES, NOISE_SD, OBSERVATION_MODEL, components, subject_features

from swesbi.artefacts import Provenance
from swesbi.context import CONTEXT_NAMES
from swesbi.networks.files import fit_standardisation
from swesbi.networks.paper.pool import Pool, augment, build_pool, noise_sd
from swesbi.networks.settings import ObservationModelSettings

OBSERVED = np.array([0.1, -0.2, 0.3, 0.0])
DRAWS = 200


def pool_of(*contexts: object, model: ObservationModelSettings = OBSERVATION_MODEL, seed: int = 7) -> Pool:
    subjects = [subject_features(context, DRAWS, OBSERVED) for context in contexts]
    return build_pool(subjects, components(), model, seed)


def raw(pool: Pool) -> np.ndarray:
    return pool.z * pool.standardisation.scale + pool.standardisation.mean


def test_noise_goes_where_it_is_named_with_its_size() -> None:
    sd = noise_sd(FEATURES, {"two": 0.5, "four": 2.0})
    features = np.random.default_rng(0).normal(size=(300, 4))
    noise = augment(features, sd, 20, np.random.default_rng(1)) - features[:, None, :]
    np.testing.assert_array_equal(noise[..., [0, 2]], 0.0)
    np.testing.assert_allclose(noise[..., [1, 3]].std(axis=(0, 1)), [0.5, 2.0], rtol=0.05)
    assert abs(np.corrcoef(noise[:, 0, 1], noise[:, 1, 1])[0, 1]) < 0.2


def test_unknown_noisy_feature_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="maximum_mmhg is not a feature"):
        noise_sd(FEATURES, {"maximum_mmhg": 1.0})


def test_rows_run_over_subjects_draws_and_augmentations() -> None:
    pool = pool_of(*CONTEXTS)
    subjects = [subject_features(context, DRAWS, OBSERVED) for context in CONTEXTS]
    assert pool.z.shape == (2 * DRAWS * 2, len(FEATURES) + len(CONTEXT_NAMES))
    for i, subject in enumerate(subjects):
        rows = pool.subject_index == i
        np.testing.assert_array_equal(pool.draw_index[rows], np.repeat(np.arange(DRAWS), 2))
        np.testing.assert_allclose(pool.theta[rows], np.repeat(subject.theta, 2, axis=0), rtol=1e-6)
        residual = raw(pool)[rows, : len(FEATURES)] - np.repeat(subject.features, 2, axis=0)
        np.testing.assert_allclose(residual.std(axis=0), NOISE_SD, rtol=0.15)
        np.testing.assert_allclose(
            raw(pool)[rows, len(FEATURES) :],
            np.broadcast_to(subject.context.as_array(), (2 * DRAWS, 7)),
            rtol=1e-5,
            atol=1e-6,
        )


def test_pool_is_standardised_and_the_observation_with_the_same_statistics() -> None:
    pool = pool_of(*CONTEXTS)
    np.testing.assert_allclose(pool.z.mean(axis=0), 0.0, atol=1e-5)
    np.testing.assert_allclose(pool.z.std(axis=0), 1.0, rtol=1e-5)
    expected = (OBSERVED - pool.standardisation.mean[:4]) / pool.standardisation.scale[:4]
    np.testing.assert_allclose(pool.observed_z("B")[:4], expected)
    np.testing.assert_allclose(np.abs(pool.z_obs[:, 4:]), 1.0)


def test_constant_component_becomes_zero() -> None:
    values = np.column_stack([np.full(10, 7.3), np.arange(10.0)])
    standardised = fit_standardisation(values).apply(values)
    np.testing.assert_allclose(standardised[:, 0], 0.0, atol=1e-9)
    assert standardised[:, 1].std() == pytest.approx(1.0)
    assert np.all(np.isfinite(pool_of(CONTEXTS[0]).z))


def test_noise_of_a_subject_depends_on_nothing_but_seed_and_subject() -> None:
    alone, together = pool_of(CONTEXTS[1]), pool_of(*CONTEXTS)
    rows = together.subject_index == 1
    np.testing.assert_allclose(raw(alone)[:, :4], raw(together)[rows, :4], atol=1e-5)
    other = pool_of(*CONTEXTS, seed=8)
    assert not np.allclose(raw(other)[:, :4], raw(together)[:, :4], atol=1e-2)
    first = [raw(together)[together.subject_index == i, :4] for i in (0, 1)]
    clean = [np.repeat(subject_features(c, DRAWS, OBSERVED).features, 2, axis=0) for c in CONTEXTS]
    assert abs(np.corrcoef((first[0] - clean[0])[:, 0], (first[1] - clean[1])[:, 0])[0, 1]) < 0.2


def test_nonfinite_feature_is_reported_with_subject_and_name() -> None:
    subject = subject_features(CONTEXTS[0], 5, OBSERVED)
    features = subject.features.copy()
    features[3, 1] = np.nan
    with pytest.raises(ValueError, match="subject A: feature two of simulation 3 is nan"):
        build_pool([replace(subject, features=features)], components(), OBSERVATION_MODEL, 1)
    with pytest.raises(ValueError, match="feature four of observation"):
        broken = replace(subject, observed=np.array([0.0, 0.0, 0.0, np.inf]))
        build_pool([broken], components(), OBSERVATION_MODEL, 1)


def test_pool_survives_its_file_and_equal_pools_give_equal_bytes(tmp_path: Path) -> None:
    pool = pool_of(*CONTEXTS)
    paths = [tmp_path / "one.h5", tmp_path / "two.h5"]
    for path in paths:
        pool.write(path, Provenance(""))
    back = Pool.read(paths[0])
    for name in ("theta", "z", "subject_index", "draw_index", "observed", "z_obs"):
        np.testing.assert_array_equal(getattr(back, name), getattr(pool, name))
        assert getattr(back, name).dtype == getattr(pool, name).dtype
    assert (back.components, back.subjects) == (pool.components, pool.subjects)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_unknown_subject_is_named() -> None:
    with pytest.raises(KeyError, match="no subject 'Z'; it holds A, B"):
        pool_of(*CONTEXTS).observed_z("Z")

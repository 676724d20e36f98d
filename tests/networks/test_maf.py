"""A flow rebuilt from its weights is the one that sbi built, and takes nothing of sbi to be used."""

import numpy as np
import pytest
import torch
from inference_case import (
    CONTEXTS,
    OBSERVATION_MODEL,
    WIDE_PRIOR,
    components,
    estimator_settings,
    subject_features,
)

from swesbi.networks.determinism import reproducible
from swesbi.networks.paper.maf import ROWS_PER_BATCH, MaskedFlow, draw_candidates, draw_until
from swesbi.networks.paper.pool import build_pool
from swesbi.networks.paper.sbi_trainer import build_net
from swesbi.networks.paper.training import train
from swesbi.prior import PriorSettings, in_bounds

ROWS, COMPONENTS = 200, 5


@pytest.mark.parametrize("z_score", ["independent", "none"])
def test_the_rebuilt_flow_draws_and_scores_as_that_of_sbi(z_score: str) -> None:
    settings = estimator_settings(z_score_theta=z_score, z_score_x=z_score, transforms=3)
    with reproducible(3):
        theta, z = 3.0 + 2.0 * torch.randn(ROWS, 3), 0.5 * torch.randn(ROWS, COMPONENTS) - 1.0
        ours = build_net(theta, z, settings).eval()
    rebuilt = MaskedFlow(settings, 3, COMPONENTS, ours.state_dict())
    assert rebuilt.state_dict().keys() == ours.state_dict().keys()
    with torch.no_grad():
        assert torch.equal(rebuilt.log_prob(theta, z), -ours.loss(theta, z))
        with reproducible(4):
            expected = ours.sample((50,), condition=z[:1])[:, 0]
        with reproducible(4):
            assert torch.equal(rebuilt.sample(50, z[:1]), expected)
    assert expected.std() > 0.1


def test_weights_of_another_size_are_refused() -> None:
    settings = estimator_settings()
    with reproducible(3):
        state = build_net(torch.randn(ROWS, 3), torch.randn(ROWS, COMPONENTS), settings).state_dict()
    with pytest.raises(RuntimeError, match="size mismatch"):
        MaskedFlow(settings, 3, COMPONENTS + 1, state)


def test_drawing_until_enough_is_the_beginning_of_drawing_all() -> None:
    subjects = [subject_features(context, 60, np.zeros(4)) for context in CONTEXTS]
    pool = build_pool(subjects, components(), OBSERVATION_MODEL, seed=3)
    settings = estimator_settings(max_num_epochs=1)
    estimator = train(pool.theta, pool.z, pool.components.names, WIDE_PRIOR, settings, 1).estimator
    everything = draw_candidates(estimator, pool.z_obs[:1], 2 * ROWS_PER_BATCH + 500, 7)[0]

    def drawn(enough: int, prior: PriorSettings = WIDE_PRIOR) -> np.ndarray:
        return draw_until(estimator, pool.z_obs[0], enough, 2 * ROWS_PER_BATCH + 500, prior, 7)

    assert in_bounds(everything, WIDE_PRIOR).sum() < len(everything), "needs some leakage"
    for enough, batches in (
        (1, ROWS_PER_BATCH),
        (ROWS_PER_BATCH, 2 * ROWS_PER_BATCH),
        (10**6, len(everything)),
    ):
        np.testing.assert_array_equal(drawn(enough), everything[:batches])

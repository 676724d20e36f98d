"""A flow rebuilt from its weights is the one that sbi built, and takes nothing of sbi to be used."""

import pytest
import torch
from inference_case import estimator_settings

from swesbi.networks.determinism import reproducible
from swesbi.networks.paper.maf import MaskedFlow
from swesbi.networks.paper.sbi_trainer import build_net

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

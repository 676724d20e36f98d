"""A proposal about the mode of a posterior, where a network knows nothing of the recording."""

from __future__ import annotations

import numpy as np
import pytest
from exact_case import SETTINGS, ToyModel, check_posterior, known_log_evidence, proposal
from scipy.stats import chi2

from swesbi.posterior.importance import weigh
from swesbi.posterior.mode import mode_proposal
from swesbi.posterior.refine import LOST_EFFICIENCY, FittedProposal, refine
from swesbi.posterior.space import LogitSpace, log_posterior_of_logit
from swesbi.prior import draw_prior, to_logit

MODEL = ToyModel()
PRIOR = MODEL.settings.prior
FAR = to_logit(draw_prior(PRIOR, 1, np.random.default_rng(3)), PRIOR)[0]


def test_the_mode_is_found_from_afar_with_the_size_of_the_posterior_about_it() -> None:
    student = mode_proposal(MODEL, FAR, 1)
    top = log_posterior_of_logit(MODEL, student.mean[None])[0]
    assert top - log_posterior_of_logit(MODEL, FAR[None])[0] > 3.0  # so there was something to climb
    around = student.mean + 0.02 * np.random.default_rng(2).standard_normal((500, len(FAR)))
    assert (log_posterior_of_logit(MODEL, around) <= top + 0.01).all()
    normal = np.random.default_rng(4).multivariate_normal(student.mean, student.scale, 4000)
    fall = np.median(top - log_posterior_of_logit(MODEL, normal))
    # half a chi-square, times the widening
    assert fall == pytest.approx(1.2 * 0.5 * chi2.median(len(FAR)), rel=0.2)


def test_it_is_a_proposal_whose_weights_are_good() -> None:
    about = FittedProposal(mode_proposal(MODEL, FAR, 1), LogitSpace(PRIOR))
    weighted = weigh(MODEL, about, 8000, 0.1, seed=1)
    assert weighted.efficiency > 0.5
    assert weighted.log_evidence == pytest.approx(known_log_evidence(), abs=0.1)
    check_posterior(weighted.phi, weighted.efficiency * 8000, weighted.weight)


def test_a_network_that_is_lost_is_refined_from_the_mode_at_once() -> None:
    lost = proposal(0.05, 6.0)
    settings = SETTINGS.refinement.model_copy(update={"max_rounds": 1, "prior_fraction": 0.01})
    refined = refine(MODEL, lost, settings, 1)
    assert refined.efficiency[0] < LOST_EFFICIENCY
    assert refined.efficiency[1] > 0.3


def test_the_same_seed_climbs_the_same_way() -> None:
    first, second = (mode_proposal(MODEL, FAR, 5) for _ in range(2))
    np.testing.assert_array_equal(first.mean, second.mean)
    np.testing.assert_array_equal(first.scale, second.scale)
    state = np.random.get_state()[1]  # noqa: NPY002
    mode_proposal(MODEL, FAR, 5)
    np.testing.assert_array_equal(state, np.random.get_state()[1])  # noqa: NPY002

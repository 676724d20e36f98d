"""A subject drawn anew under a narrower prior of theta, against the likelihood of all four parameters."""

from __future__ import annotations

from dataclasses import replace

import exact_case as case
import numpy as np
import speed_case

from swesbi.parameters import OF_THETA, THETA_NAMES
from swesbi.persons.cohort.infer import redraw_theta

NARROW = 0.15
FACTORS = np.array([1.2, 0.8, 1.2])
WEIGHTED = 8000


def test_draws_follow_the_likelihood_under_the_other_prior() -> None:
    """Nothing is integrated out of what they are compared with."""
    model = speed_case.model()
    joint = model.settings.prior
    own = zip(THETA_NAMES, joint.theta.parameters, FACTORS, strict=True)
    narrower = joint.theta.model_copy(
        update={
            name: one.model_copy(update={"centre": one.centre * factor, "log_sd": NARROW})
            for name, one, factor in own
        }
    )
    changed = model.settings.model_copy(update={"prior": joint.model_copy(update={"theta": narrower})})
    narrowed = replace(model, settings=changed)
    stored, known = (
        case.weigh(each, case.fitted(each), WEIGHTED, 0.1, seed)
        for seed, each in enumerate((model, narrowed), start=1)
    )
    anew = np.log(redraw_theta(model, (stored.phi, stored.log_weight), narrower, case.SETTINGS, 3))
    log_theta = np.log(known.phi[:, OF_THETA])
    mean = known.weight @ log_theta
    sd = np.sqrt(known.weight @ (log_theta - mean) ** 2)
    error = sd * np.sqrt(1.0 / case.SETTINGS.effective_draws + 1.0 / (known.efficiency * WEIGHTED))
    assert (error < 0.04 * sd).all()
    assert (np.abs(anew.mean(axis=0) - mean) < 4.5 * error).all()
    np.testing.assert_allclose(anew.std(axis=0), sd, rtol=0.1)
    before = stored.weight @ np.log(stored.phi[:, OF_THETA])
    assert np.abs(before - mean).max() > 20.0 * error.max()

"""The table of what is not known of a heart: priors, their reasons, contraction."""

from __future__ import annotations

import numpy as np
import pytest
from study_copy import ROOT

from swesbi.config.read import parse_config, read_merged
from swesbi.heart.physiology import VOLUME_FACTOR
from swesbi.parameters import NUISANCES
from swesbi.prior import JointPriorSettings, sample
from swesbi.report.numbers import MISSING
from tools.docs.nuisances import nuisances, nuisances_part


def shipped() -> JointPriorSettings:
    config = parse_config(read_merged(ROOT / "config.yaml"))
    experiment = config.speed_experiments["calibrated"]
    return JointPriorSettings(
        theta=config.priors[experiment.prior], passive_stiffness_kpa=experiment.passive_stiffness_kpa
    )


def test_every_shipped_nuisance_has_its_row_and_its_reason() -> None:
    free = nuisances(shipped(), [])
    # the stressed volume is free with cuff pressures alone
    assert [each.parameter for each in free] == [one for one in NUISANCES if one.name != VOLUME_FACTOR]
    assert all(len(each.reason) > 40 for each in free)
    rows = nuisances_part(free).splitlines()[2:14]
    assert [row.split(" | ")[4] for row in rows] == [MISSING] * len(free)
    assert [row.endswith(f"{each.reason} |") for each, row in zip(free, rows, strict=True)] == [True] * 12
    assert free[0].reason.startswith("The pre-ejection period has a standard deviation of 13 ms")
    assert "| 0.32 | 0.055 | 0.257 to 0.399 |" in rows[1]


def test_contraction_is_that_of_the_logarithm_and_of_the_parameter_named() -> None:
    prior = shipped()
    rng = np.random.default_rng(1)
    told = [sample(20_000, prior, rng) for _ in range(3)]
    column = prior.names.index("passive_ratio")
    for phi, factor in zip(told, (0.5, 0.2, 0.1), strict=True):
        phi[:, column] **= factor
    free = {each.parameter.name: each for each in nuisances(prior, told)}
    assert free["passive_ratio"].contraction == pytest.approx([0.75, 0.96, 0.99], abs=0.01)
    assert free["sigma_0_pa"].contraction == pytest.approx(0.0, abs=0.04)
    part = nuisances_part(tuple(free.values()))
    row = next(line for line in part.splitlines() if "`passive_ratio`" in line)
    assert "| 0.96 (0.75 to 0.99) |" in row

"""The change in groups, on changes of made-up ratios."""

from __future__ import annotations

import logging
from dataclasses import replace
from itertools import combinations_with_replacement
from pathlib import Path
from types import SimpleNamespace

import hierarchy_case as case
import numpy as np
import pytest
import ratio_case
from test_compare_command import stored

from swesbi.artefacts import Provenance
from swesbi.persons.change.groups import change_in_groups, verdict_of_pair
from swesbi.persons.change.one_person import OnePerson
from swesbi.persons.change.stored import StoredChange
from swesbi.persons.cohort.stored import CohortPosterior
from swesbi.study.compare import GROUP_OUTPUTS, save_groups
from swesbi.verdict.verdict import STATUSES, Status

TWO_PERSONS = OnePerson(-3.0, -2.0, 0.01, 0.05, 4.0)


def changes() -> list[StoredChange]:
    """Changes of eight persons; the last one's recordings are of two."""
    rng = np.random.default_rng(2)
    found = []
    for number in range(8):
        effect = np.log(0.7) if number % 2 else 0.0
        draws = 20.0 * np.exp(0.05 * rng.standard_normal((2, 600, 4)))
        draws[1, :, 2] *= np.exp(effect)
        verdict = np.array(["not contradicted", "not contradicted" if number else "uninformative"])
        one = replace(stored(), person=f"P{number}", verdict=verdict)
        found.append(replace(one, phi=draws[:, :, :2], quantities=draws))
    return [*found[:-1], replace(found[-1], one_person=TWO_PERSONS)]


@pytest.mark.parametrize(("good", "bad"), [*combinations_with_replacement(STATUSES, 2)])
def test_a_pair_has_the_worse_verdict_of_both_visits(good: Status, bad: Status) -> None:
    one = replace(stored(), verdict=np.array([good, bad]))
    assert verdict_of_pair(one) == verdict_of_pair(replace(one, verdict=one.verdict[::-1])) == bad
    assert verdict_of_pair(replace(one, one_person=TWO_PERSONS)) == "contradicted"
    assert verdict_of_pair(replace(one, converged=False)) == "contradicted"


def test_all_of_it_is_inferred_written_and_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    context = case.contexts(1, np.random.default_rng(1))[0]
    made = change_in_groups(
        changes(),
        [SimpleNamespace(context=context)] * 8,
        prior=case.THETA_PRIOR,
        change_groups=ratio_case.SETTINGS.model_copy(update={"draws": 600}),
        cohort_posterior=ratio_case.EFFORT,
        groups={f"P{number}": "treated" if number % 2 else "control" for number in range(8)},
        left_out=("left out with one visit, since a change needs two: P9",),
        seed=1,
    )
    with caplog.at_level(logging.INFO, logger="swesbi"):
        save_groups(made, tmp_path, Provenance(""), "made-up persons")
    assert {path.name for path in tmp_path.iterdir()} == set(GROUP_OUTPUTS)
    found = CohortPosterior.read(tmp_path / GROUP_OUTPUTS[0])
    assert found.groups == ("control", "treated")
    factor = found.population.group_factor[0, :, 0, 2]
    assert np.quantile(factor, 0.05) < 0.7 < np.quantile(factor, 0.95)
    assert found.members.outlier_prior[-1] == case.OUTLIERS.contradicted
    assert (found.verdict[0], found.members.outlier_prior[0]) == (
        "uninformative", case.OUTLIERS.not_contradicted,
    )  # fmt: skip
    said = "\n".join(caplog.messages)
    assert "treated rose less than control, or fell more, with a probability of" in said
    assert "Left out with one visit, since a change needs two: P9." in said
    assert "counted as outliers, since both recordings are not of one person: P7" in said.replace("C", "c")

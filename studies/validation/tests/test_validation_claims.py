"""The numbers of the page are those of the stored tables and of the settings."""

from pathlib import Path

import pytest
from study_copy import ROOT

from tools.claims.findings import HOLDS
from tools.verify import verified


def test_every_claim_of_the_page_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    found = verified(Path("config.yaml"), None, "none", Path("studies/validation/claims.yaml"))
    own = [each for each in found if each.where.startswith("studies/")]
    assert own
    assert [each for each in own if each.outcome != HOLDS] == []

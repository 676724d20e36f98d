"""What the package ships is of the model that it ships with."""

from pathlib import Path

import pytest

from swesbi.networks.flow.trained import SHIPPED_NETWORK
from swesbi.verdict.settings import SHIPPED_NULLS
from tools.model_version import MODEL_VERSION
from tools.shipped import shipped_version


@pytest.mark.parametrize("path", [SHIPPED_NETWORK, SHIPPED_NULLS])
def test_what_is_shipped_is_of_this_version_of_the_model(path: Path) -> None:
    assert shipped_version(path) == MODEL_VERSION, "run the study, then `python -m tools.shipped`"

"""The null distributions that are shipped are of the model as it is."""

from swesbi.study.model_version import MODEL_VERSION
from tools.nulls import shipped_version


def test_shipped_nulls_were_made_by_this_version_of_the_model() -> None:
    assert shipped_version() == MODEL_VERSION, "run the study, then `python -m tools.nulls`"

"""Ship null recordings that a study made, for every study and answer of the same model.

    .venv/bin/snakemake --cores 2 results/amortised/null.h5
    python -m tools.nulls results/amortised/null.h5

They are of the population of `amortised`, at the phases and noise levels of its conditions, under the shipped
configuration. What is shipped says by which settings and which version of the model it was made.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from swesbi.artefacts import Provenance, load, save
from swesbi.artefacts.files import hdf5_provenance
from swesbi.study.model_version import MODEL_VERSION
from swesbi.verdict.null_recordings import KIND, null_groups, read_nulls
from swesbi.verdict.settings import SHIPPED_NULLS

VERSION: Final = "model_version"
"""Key of the settings of the shipped file."""


def main(arguments: Sequence[str]) -> int:
    """Write what is shipped; return 0.

    Raises:
        ArtefactError: The file holds no null recordings.
    """
    (source,) = arguments
    null, provenance = read_nulls(Path(source)), hdf5_provenance(Path(source))
    settings = dict(provenance.settings) | {VERSION: MODEL_VERSION}
    shipped = replace(provenance, settings=settings, code_hash="")
    save(SHIPPED_NULLS, null_groups(null), shipped)
    counts = f"{len(null.contexts)} gated and {len(null.pushes)} free-running recordings"
    print(f"wrote {SHIPPED_NULLS}: {counts}, version {MODEL_VERSION} of the model")
    return 0


def shipped_version() -> int:
    """Return the version of the model by which the shipped file was made."""
    provenance: Provenance = load(SHIPPED_NULLS, KIND)[1]
    return int(provenance.settings[VERSION])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

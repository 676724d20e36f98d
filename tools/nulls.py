"""Ship the null distributions of a finished study, for recordings that are answered without one.

    python -m tools.nulls results/amortised/null.h5

They are of the population of `amortised`, at the phases and noise levels of its conditions, under the shipped
configuration. What is shipped says by which version of the model it was made.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from swesbi.answers.knowledge import SHIPPED_NULLS
from swesbi.artefacts import Provenance, load, save
from swesbi.artefacts.files import hdf5_provenance
from swesbi.study.model_version import MODEL_VERSION
from swesbi.verdict.pooled import KIND, null_groups, read_null

VERSION: Final = "model_version"
"""Key of the settings of the shipped file."""


def main(arguments: Sequence[str]) -> int:
    """Write what is shipped; return 0.

    Raises:
        ArtefactError: The file holds no null recordings.
    """
    (source,) = arguments
    null, provenance = read_null(Path(source)), hdf5_provenance(Path(source))
    shipped = replace(provenance, settings={VERSION: MODEL_VERSION}, code_hash="")
    save(SHIPPED_NULLS, null_groups(null), shipped)
    counts = f"{len(null.contexts)} gated and {len(null.pushes.pushes)} free-running recordings"
    print(f"wrote {SHIPPED_NULLS}: {counts}, version {MODEL_VERSION} of the model")
    return 0


def shipped_version() -> int:
    """Return the version of the model by which the shipped file was made."""
    provenance: Provenance = load(SHIPPED_NULLS, KIND)[1]
    return int(provenance.settings[VERSION])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

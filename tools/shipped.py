"""Ship the network of a population and its null recordings, for every study and answer of the same model.

    .venv/bin/snakemake --cores 2 results/amortised/null.h5
    python -m tools.shipped results/amortised

They are of the population of `amortised`, at the phases and noise levels of its conditions, under the shipped
configuration. What is shipped says by which settings and which version of the model it was made.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from swesbi.artefacts import Provenance
from swesbi.artefacts.files import hdf5_provenance
from swesbi.networks.flow.trained import SHIPPED_NETWORK, TrainedFlow
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.settings import SHIPPED_NULLS
from tools.model_version import MODEL_VERSION

VERSION: Final = "model_version"
"""Key of the settings of the shipped files."""


def main(arguments: Sequence[str]) -> int:
    """Write what is shipped of a folder of results; return 0."""
    (folder,) = map(Path, arguments)
    flow, trained = TrainedFlow.read(folder / "flow.h5"), hdf5_provenance(folder / "flow.h5")
    null, drawn = NullRecordings.read(folder / "null.h5"), hdf5_provenance(folder / "null.h5")
    flow.write(SHIPPED_NETWORK, _shipped(trained))
    null.write(SHIPPED_NULLS, _shipped(drawn))
    counts = f"{len(null.contexts)} gated and {len(null.pushes)} free-running recordings"
    print(f"wrote {SHIPPED_NETWORK} and {SHIPPED_NULLS}: {counts}, version {MODEL_VERSION} of the model")
    return 0


def _shipped(provenance: Provenance) -> Provenance:
    return replace(provenance, settings=dict(provenance.settings) | {VERSION: MODEL_VERSION}, code_hash="")


def shipped_version(path: Path) -> int:
    """Return the version of the model by which a shipped file was made."""
    return int(hdf5_provenance(path).settings[VERSION])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

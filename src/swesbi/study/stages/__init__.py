"""The stages of the study: each reads artefacts, calls the science, writes artefacts.

``registry`` finds them: the public functions that take ``settings`` and ``origin`` by name. Modules are cut
so that the stages of one module import the same heavy libraries, since a job imports the whole of it.

The paths that a stage takes are its inputs and its outputs; ``settings`` is what its results depend on beside
its inputs, ``origin`` is seed, subject and code hash, recorded in the output.
"""

from __future__ import annotations

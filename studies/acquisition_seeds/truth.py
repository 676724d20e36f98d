"""What is true of a virtual volunteer, told by the context of a recording."""

from __future__ import annotations

from swesbi.artefacts import ArtefactError
from swesbi.context import Context
from swesbi.virtual.volunteers import VOLUNTEERS, Truth, simulate_truth


def truth_of(context: Context) -> Truth:
    """Return what is true of the virtual volunteer with this context.

    Raises:
        ArtefactError: There is none.
    """
    for volunteer in VOLUNTEERS:
        if volunteer.context == context:
            return simulate_truth(volunteer)
    raise ArtefactError(
        f"subject {context.subject}: its context is that of no virtual volunteer; only virtual volunteers "
        "can be recorded anew"
    )

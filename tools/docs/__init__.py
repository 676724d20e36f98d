"""Tables and figures of README and docs/, from a finished study: ``python -m tools.docs``."""

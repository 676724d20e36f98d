"""The parts of the documentation that are written from a finished study: ``python -m tools.docs``."""

"""The figures of the study; only here is matplotlib imported, without pyplot and without a display."""

"""The noise of the measured speeds, estimated from the repeats of the whole cohort by a mixed model."""

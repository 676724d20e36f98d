"""Programs around a finished study, which the study does not need."""

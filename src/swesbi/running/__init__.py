"""Running the study as a whole: one run at a time, what a killed run left, jobs without a run."""

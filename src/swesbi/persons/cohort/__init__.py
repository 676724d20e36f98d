"""The cohort as a posterior: what a population is like, estimated from the posteriors of its subjects."""

"""The cohort as a posterior: what a population is like, told from the posteriors of its subjects."""

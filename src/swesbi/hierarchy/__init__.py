"""The cohort as a posterior: what a population of hearts is like, told from the posteriors of its subjects."""

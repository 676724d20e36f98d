"""Neural posterior estimation as in the paper: the training pool, the estimator, its training, its draws."""

"""From a network to an answer: the paper's truncated draws, exact weights, MCMC where weights fail."""

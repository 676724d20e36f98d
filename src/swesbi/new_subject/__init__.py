"""A subject outside the pool, answered by the network as it is, or refused with the reason."""

"""The networks: q(theta | z) of the paper, and q(phi | z) of experiments on speeds."""

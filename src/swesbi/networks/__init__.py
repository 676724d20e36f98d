"""The networks: q(theta | z) of the paper, and q(heart | z) of experiments on speeds."""

"""The network of experiments on measured speeds: a normalising flow q(phi | z) in the logit of the box."""

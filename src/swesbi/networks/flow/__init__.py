"""The network of experiments on measured speeds: a normalising flow q(heart | z) in the logit of the box."""

"""The network of experiments on measured speeds: a normalising flow q(phi | z) in the logit of the box.

It is trained on fresh noise every epoch and serves as the proposal of the exact posterior.
"""

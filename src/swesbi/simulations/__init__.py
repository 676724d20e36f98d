"""Simulations from the prior: what the network learns from."""

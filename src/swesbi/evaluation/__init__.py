"""Predictive checks, scores, and the CMA-ES reference fit.

Only ``cmaes`` imports the library ``cma``; readers of its results need not.
"""

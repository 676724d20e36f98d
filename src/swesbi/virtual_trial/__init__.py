"""A virtual trial: two groups of persons, each recorded twice, one group treated in between.

``python -m swesbi.virtual_trial data/virtual_trial`` regenerates the shipped one.
"""

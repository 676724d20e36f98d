"""A virtual trial: two groups of persons, each recorded twice, one group treated in between.

``python data/virtual_trial/make.py`` writes the shipped one anew.
"""

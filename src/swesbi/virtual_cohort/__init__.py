"""Eight virtual volunteers: a richer physiology than the inference model, measured with acquisition noise.

``python -m swesbi.virtual_cohort data/virtual_volunteers`` regenerates the shipped cohort.
"""

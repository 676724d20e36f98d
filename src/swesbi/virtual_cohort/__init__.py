"""Eight virtual volunteers: a richer physiology than the inference model, measured with acquisition noise.

``python data/virtual_volunteers/make.py`` writes the shipped cohort anew.
"""

"""How far the model may miss the truth: delta and tau chosen on a generated cohort with known model error.

None of its subjects is in the study's cohort.
"""

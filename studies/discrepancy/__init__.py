"""How far the model may miss the truth: delta and tau chosen on a generated cohort with known model error."""

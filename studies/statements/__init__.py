"""How firmly the paper's statements agree: other trainings, other recordings, other readings of the text."""

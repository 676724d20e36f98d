"""The page on which a reader moves parameters and sees the curve move; the study runs without it."""

"""The page on which a reader moves parameters and sees the curve move, and drops a recording in."""

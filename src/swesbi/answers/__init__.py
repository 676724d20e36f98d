"""From one recording to its answer: posterior, verdict, predictive check, page."""

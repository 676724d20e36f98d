"""What the answers rest on: recovery, calibration, predictions, CMA-ES, identifiability, evidence."""

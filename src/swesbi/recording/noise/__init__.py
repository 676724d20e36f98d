"""The noise of measured speeds: estimated from repeats, by cohort or folder, or declared; standard errors."""

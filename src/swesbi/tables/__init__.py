"""The tables of the study, as CSV and LaTeX."""

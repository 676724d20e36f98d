"""Shipped data, and the programs that made it; the study reads the data and runs without the programs."""

"""Readings of the paper's text: which choices that it leaves open give the numbers that it prints."""

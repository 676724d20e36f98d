"""Visits of one person, inferred together, and what has changed between them."""

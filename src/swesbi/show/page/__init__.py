"""The landing page of the results: what was done, what came out, and where every file lies."""

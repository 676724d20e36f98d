"""The pages of the results: what was done, what came out, and where every file lies."""

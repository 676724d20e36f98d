"""What makes an edit rerun what depends on it: a hash of the code that a stage runs."""

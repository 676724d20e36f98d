"""Looking into the files of a study, and comparing two runs of it."""

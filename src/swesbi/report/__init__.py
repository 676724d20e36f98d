"""What the study shows: figures, tables, the page of results, the documentation, the paper beside it."""

"""Questions about the study, a folder each; the study runs without any of them."""

"""The paper's numbers beside this study's: what the paper printed, what answers to it, how the two differ."""

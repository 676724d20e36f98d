"""What the programs that make shipped recordings share."""

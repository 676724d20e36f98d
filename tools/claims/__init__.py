"""What README and documentation claim in numbers, and whether tables, settings and code say the same."""

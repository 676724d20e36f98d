"""What makes the stored hearts of other generators."""

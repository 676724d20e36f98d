"""What the exact posteriors owe to choices that could have been made otherwise."""

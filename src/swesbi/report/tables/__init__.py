"""The tables of numbers that the page and the documentation show."""

"""Python to JavaScript: the functions of the study that a page needs, so that the physics is said once."""

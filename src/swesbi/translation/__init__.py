"""Python to JavaScript: the functions of the package that a page needs, so that the physics is said once."""

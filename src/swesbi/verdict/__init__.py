"""May this posterior be read? Prior support, tests with a null distribution, and one verdict a subject."""

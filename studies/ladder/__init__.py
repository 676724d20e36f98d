"""A ladder of structures: what the posteriors of a study owe to the equations that they assume."""

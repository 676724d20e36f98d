"""How many persons, and how many repeats, a study needs to tell an effect: from simulated studies."""

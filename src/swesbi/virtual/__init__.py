"""Hearts that are simulated: volunteers, generated subjects, hearts of other generators, a trial."""

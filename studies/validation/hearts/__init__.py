"""Hearts that are not the inference model: of other ranges, other equations and other programs, recorded."""

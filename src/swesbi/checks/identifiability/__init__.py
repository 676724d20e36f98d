"""What a recording can tell about phi, which phases tell it, and what more repeats or phases would add."""

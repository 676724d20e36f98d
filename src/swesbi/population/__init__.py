"""The population of contexts on which one network is trained, and its declared range."""

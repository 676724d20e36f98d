"""Tests of side studies take the finished small study of the study's own tests."""

from small_study import finished, own_study

__all__ = ["finished", "own_study"]

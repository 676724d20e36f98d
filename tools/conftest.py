"""Tests of the tools take the finished small study of the study's own tests."""

from small_study import editable, finished, own_study

__all__ = ["editable", "finished", "own_study"]

"""Measurement operator, passive baseline and summary: from simulated beats to what inference compares."""

from __future__ import annotations

"""The forward model: a spherical left ventricle in a circulation, from theta to one periodic beat."""

from __future__ import annotations

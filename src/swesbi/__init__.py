"""swesbi: simulation-based inference of cardiac mechanics from shear wave elastography."""

__version__ = "0.1.0"

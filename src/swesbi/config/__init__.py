"""The configuration of the study: typed, checked before any job starts, sliced by stage."""

from __future__ import annotations

from swesbi.config.experiments import ExperimentSettings
from swesbi.config.models import Config
from swesbi.config.read import (
    ConfigError,
    overlay,
    parse_config,
    read_merged,
    read_yaml,
    snakemake_options,
)
from swesbi.config.study import Study, load_study

__all__ = [
    "Config",
    "ConfigError",
    "ExperimentSettings",
    "Study",
    "load_study",
    "overlay",
    "parse_config",
    "read_merged",
    "read_yaml",
    "snakemake_options",
]

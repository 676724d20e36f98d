"""The configuration of the study: typed, checked before any job starts, sliced by stage."""

from swesbi.config.errors import ConfigError
from swesbi.config.models import Config, ExperimentSettings
from swesbi.config.read import overlay, parse_config, read_yaml
from swesbi.config.study import Study, load_study

__all__ = [
    "Config",
    "ConfigError",
    "ExperimentSettings",
    "Study",
    "load_study",
    "overlay",
    "parse_config",
    "read_yaml",
]

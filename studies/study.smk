"""What a side study begins with: the study it asks about, its own section of the configuration, params of its stages.

Files of the study are inputs that no rule makes: `make study` comes first.
"""

import sys
from pathlib import Path

from swesbi.config.read import parse_section, read_yaml

HERE = Path(workflow.basedir)


SECTION = config.pop(HERE.name, None)


include: "../workflow/rules/common.smk"


sys.path.insert(0, str(HERE.parents[1]))
OUT = f"<results>/studies/{HERE.name}"


from studies.section import left_out


def section_of(model):
    """Return the side study's own section of the configuration, without variants for which a file says null."""
    own = read_yaml(HERE / "config.yaml")[HERE.name]
    try:
        return parse_section(
            left_out(SECTION, own, model),
            f"studies/{HERE.name}/config.yaml",
            model,
            [HERE / "config.yaml", *workflow.overwrite_configfiles],
            HERE.name,
        )
    except ConfigError as error:
        raise WorkflowError(str(error)) from None


def own_stage(name, settings):
    """Return the params of a stage of this side study; ``settings`` gives its values by name under wildcards."""

    def values(wildcards):
        try:
            return settings(wildcards)
        except ConfigError as error:
            raise WorkflowError(str(error)) from None

    return stage_params(f"studies.{HERE.name}.stages:{name}", values, CONFIG.seed)

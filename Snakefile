# The whole study: `snakemake --cores 2`. One subject: `snakemake --cores 2 results/paper/subjects/A/ppc.png`.
import sys

from snakemake.utils import min_version

min_version("9.0")

try:
    import swesbi
except ModuleNotFoundError as error:
    raise WorkflowError(
        f"the environment of this Snakemake, {sys.prefix}, has no {error.name}. Type `make install`, then "
        "`.venv/bin/snakemake --cores 2`; or `pip install -r environment.txt` into the environment"
    ) from None


report: "workflow/report/study.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/targets.smk"
include: "workflow/rules/cohort.smk"
include: "workflow/rules/simulations.smk"
include: "workflow/rules/inference.smk"
include: "workflow/rules/speeds.smk"
include: "workflow/rules/populations.smk"
include: "workflow/rules/pressures.smk"
include: "workflow/rules/cohort_posterior.smk"
include: "workflow/rules/full.smk"
include: "workflow/rules/evaluation.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/report.smk"


if EXPLORER.is_file():

    include: "explorer/rules.smk"


rule all:
    default_target: True
    input:
        study_outputs(),

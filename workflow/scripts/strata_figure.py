from swesbi.stages import strata_figure
from swesbi.stages.job import run_job

run_job(snakemake, strata_figure.run)

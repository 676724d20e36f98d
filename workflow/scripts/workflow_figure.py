from swesbi.stages import workflow_figure
from swesbi.stages.job import run_job

run_job(snakemake, workflow_figure.run)

from swesbi.stages import sensitivity_run
from swesbi.stages.job import run_job

run_job(snakemake, sensitivity_run.run)

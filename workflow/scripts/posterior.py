from swesbi.stages import posterior
from swesbi.stages.job import run_job

run_job(snakemake, posterior.run)

from swesbi.stages import exact_posterior
from swesbi.stages.job import run_job

run_job(snakemake, exact_posterior.run)

from swesbi.stages import noise
from swesbi.stages.job import run_job

run_job(snakemake, noise.run)

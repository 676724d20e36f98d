from swesbi.stages import speed_pool
from swesbi.stages.job import run_job

run_job(snakemake, speed_pool.run)

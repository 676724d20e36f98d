from swesbi.stages import pool
from swesbi.stages.job import run_job

run_job(snakemake, pool.run)

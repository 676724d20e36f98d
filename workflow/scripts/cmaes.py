from swesbi.stages import cmaes
from swesbi.stages.job import run_job

run_job(snakemake, cmaes.run)

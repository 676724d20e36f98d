from swesbi.stages import simulate
from swesbi.stages.job import run_job

run_job(snakemake, simulate.run)

from swesbi.stages import population_simulate
from swesbi.stages.job import run_job

run_job(snakemake, population_simulate.run)

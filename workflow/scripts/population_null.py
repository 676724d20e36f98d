from swesbi.stages import population_null
from swesbi.stages.job import run_job

run_job(snakemake, population_null.run)

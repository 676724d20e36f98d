from swesbi.stages import population_cohort
from swesbi.stages.job import run_job

run_job(snakemake, population_cohort.run)

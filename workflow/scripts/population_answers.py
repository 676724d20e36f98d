from swesbi.stages import population_answers
from swesbi.stages.job import run_job

run_job(snakemake, population_answers.run)

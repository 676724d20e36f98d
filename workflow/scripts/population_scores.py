from swesbi.stages import population_scores
from swesbi.stages.job import run_job

run_job(snakemake, population_scores.run)

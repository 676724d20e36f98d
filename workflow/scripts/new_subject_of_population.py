from swesbi.stages import new_subject_of_population
from swesbi.stages.job import run_job

run_job(snakemake, new_subject_of_population.run)

from swesbi.stages import train_population
from swesbi.stages.job import run_job

run_job(snakemake, train_population.run)

from swesbi.stages import acquisition_seeds
from swesbi.stages.job import run_job

run_job(snakemake, acquisition_seeds.run)

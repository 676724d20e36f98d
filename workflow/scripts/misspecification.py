from swesbi.stages import misspecification
from swesbi.stages.job import run_job

run_job(snakemake, misspecification.run)

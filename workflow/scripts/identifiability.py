from swesbi.stages import identifiability
from swesbi.stages.job import run_job

run_job(snakemake, identifiability.run)

from swesbi.stages import recovery
from swesbi.stages.job import run_job

run_job(snakemake, recovery.run)

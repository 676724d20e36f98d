from swesbi.stages import epochs
from swesbi.stages.job import run_job

run_job(snakemake, epochs.run)

from swesbi.stages import verdict
from swesbi.stages.job import run_job

run_job(snakemake, verdict.run)

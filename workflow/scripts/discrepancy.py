from swesbi.stages import discrepancy
from swesbi.stages.job import run_job

run_job(snakemake, discrepancy.run)

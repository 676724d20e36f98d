from swesbi.stages import misspecification_table
from swesbi.stages.job import run_job

run_job(snakemake, misspecification_table.run)

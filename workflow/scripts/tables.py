from swesbi.stages import tables
from swesbi.stages.job import run_job

run_job(snakemake, tables.run)

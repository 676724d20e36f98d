from swesbi.stages import passive
from swesbi.stages.job import run_job

run_job(snakemake, passive.run)

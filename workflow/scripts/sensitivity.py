from swesbi.stages import sensitivity
from swesbi.stages.job import run_job

run_job(snakemake, sensitivity.run)

from swesbi.stages import truth
from swesbi.stages.job import run_job

run_job(snakemake, truth.run)

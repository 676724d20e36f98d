from swesbi.stages import predictive
from swesbi.stages.job import run_job

run_job(snakemake, predictive.run)

from swesbi.stages import predictive_speeds
from swesbi.stages.job import run_job

run_job(snakemake, predictive_speeds.run)

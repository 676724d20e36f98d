from swesbi.stages import calibration
from swesbi.stages.job import run_job

run_job(snakemake, calibration.run)

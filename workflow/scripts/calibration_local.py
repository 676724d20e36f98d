from swesbi.stages import calibration_local
from swesbi.stages.job import run_job

run_job(snakemake, calibration_local.run)

from swesbi.stages import calibration_recordings
from swesbi.stages.job import run_job

run_job(snakemake, calibration_recordings.run)

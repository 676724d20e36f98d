from swesbi.stages import calibration_figure
from swesbi.stages.job import run_job

run_job(snakemake, calibration_figure.run)

from swesbi.stages import population_calibration
from swesbi.stages.job import run_job

run_job(snakemake, population_calibration.run)

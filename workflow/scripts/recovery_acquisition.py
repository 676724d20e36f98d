from swesbi.stages import recovery_acquisition
from swesbi.stages.job import run_job

run_job(snakemake, recovery_acquisition.run)

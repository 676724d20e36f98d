from swesbi.stages import train_flow
from swesbi.stages.job import run_job

run_job(snakemake, train_flow.run)

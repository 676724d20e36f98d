from swesbi.stages import experiments_figure
from swesbi.stages.job import run_job

run_job(snakemake, experiments_figure.run)

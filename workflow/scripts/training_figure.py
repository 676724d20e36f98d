from swesbi.stages import training_figure
from swesbi.stages.job import run_job

run_job(snakemake, training_figure.run)

from swesbi.stages import epochs_figure
from swesbi.stages.job import run_job

run_job(snakemake, epochs_figure.run)

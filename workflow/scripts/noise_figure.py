from swesbi.stages import noise_figure
from swesbi.stages.job import run_job

run_job(snakemake, noise_figure.run)

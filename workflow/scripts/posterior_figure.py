from swesbi.stages import posterior_figure
from swesbi.stages.job import run_job

run_job(snakemake, posterior_figure.run)

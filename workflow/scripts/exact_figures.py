from swesbi.stages import exact_figures
from swesbi.stages.job import run_job

run_job(snakemake, exact_figures.run)

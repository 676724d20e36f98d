from swesbi.stages import exact_figure
from swesbi.stages.job import run_job

run_job(snakemake, exact_figure.run)

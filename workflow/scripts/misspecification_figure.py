from swesbi.stages import misspecification_figure
from swesbi.stages.job import run_job

run_job(snakemake, misspecification_figure.run)

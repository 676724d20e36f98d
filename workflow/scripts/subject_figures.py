from swesbi.stages import subject_figures
from swesbi.stages.job import run_job

run_job(snakemake, subject_figures.run)

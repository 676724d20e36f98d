from swesbi.stages import exact_subject_figures
from swesbi.stages.job import run_job

run_job(snakemake, exact_subject_figures.run)

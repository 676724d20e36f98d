from swesbi.stages import cohort_figures
from swesbi.stages.job import run_job

run_job(snakemake, cohort_figures.run)

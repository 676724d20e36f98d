from swesbi.stages import identifiability_figures
from swesbi.stages.job import run_job

run_job(snakemake, identifiability_figures.run)

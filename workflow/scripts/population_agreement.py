from swesbi.stages import population_agreement
from swesbi.stages.job import run_job

run_job(snakemake, population_agreement.run)

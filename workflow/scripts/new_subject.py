from swesbi.stages import new_subject
from swesbi.stages.job import run_job

run_job(snakemake, new_subject.run)

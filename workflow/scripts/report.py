from swesbi.stages import report
from swesbi.stages.job import run_job

run_job(snakemake, report.run)

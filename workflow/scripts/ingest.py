from swesbi.stages import ingest
from swesbi.stages.job import run_job

run_job(snakemake, ingest.run)

from swesbi.stages import ingest_batch
from swesbi.stages.job import run_job

run_job(snakemake, ingest_batch.run)

from swesbi.stages import train
from swesbi.stages.job import run_job

run_job(snakemake, train.run, device=snakemake.config["resources"]["device"])

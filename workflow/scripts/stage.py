"""Run the stage that the rule's params name."""

from swesbi.study.job import run_job

run_job(snakemake)

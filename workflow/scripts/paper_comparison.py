from swesbi.stages import paper_comparison
from swesbi.stages.job import run_job

run_job(snakemake, paper_comparison.run)

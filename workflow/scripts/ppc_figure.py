from swesbi.stages import ppc_figure
from swesbi.stages.job import run_job

run_job(snakemake, ppc_figure.run)

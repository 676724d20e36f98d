"""Run the stage that the rule's params name."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(snakemake.scriptdir).resolve().parent))

from swesbi.study.job import run_job

run_job(snakemake)

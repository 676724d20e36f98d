"""Run the stage that the rule's params name; those of other packages lie at the project's root."""

import sys
from pathlib import Path

from swesbi.study.job import run_job

sys.path.append(str(Path(snakemake.scriptdir).resolve().parents[1]))
run_job(snakemake)

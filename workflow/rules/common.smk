"""The validated study, and what every rule needs of it: paths, subjects and the params of each stage."""

import sys

from swesbi.code_hash import stage_hash
from swesbi.config import ConfigError, load_study
from swesbi.config.slices import stage_settings

try:
    STUDY = load_study(config, "configuration (config.yaml with what is merged over it)")
except ConfigError as error:
    raise WorkflowError(str(error)) from None

CONFIG = STUDY.config
RESULTS = CONFIG.results
SUBJECTS = list(STUDY.subjects)
EXPERIMENTS = list(CONFIG.experiments)
SHARDS = range(CONFIG.resources.shards_per_subject)
IMAGES = ["pdf", "png"]


wildcard_constraints:
    subject="|".join(SUBJECTS),
    experiment="|".join(EXPERIMENTS),
    prior="|".join(CONFIG.priors),
    shard=r"\d+",


def stage(name):
    """Return the function that gives a stage's params: one plain dict, since Snakemake compares params unnamed."""

    def params(wildcards):
        return {
            "code": stage_hash(f"swesbi.stages.{name}"),
            "seed": CONFIG.seed,
            "settings": stage_settings(STUDY, name, **dict(wildcards.items())),
            "subject": wildcards.get("subject", ""),
        }

    return params


def of_subjects(pattern):
    """Return a pattern's paths for every subject of the cohort, other wildcards left open."""
    return expand(f"{RESULTS}/{pattern}", subject=SUBJECTS, allow_missing=True)


def prior_of(wildcards):
    return CONFIG.experiments[wildcards.experiment].prior


def shards_of_subject(wildcards):
    """Return the shards of one subject under the experiment's prior."""
    return expand(
        f"{RESULTS}/simulations/{{prior}}/{{subject}}/shard-{{shard}}.h5",
        prior=prior_of(wildcards),
        subject=wildcards.subject,
        shard=SHARDS,
    )


def shards_of_cohort(wildcards):
    """Return the shards of every subject under the experiment's prior."""
    return expand(
        f"{RESULTS}/simulations/{{prior}}/{{subject}}/shard-{{shard}}.h5",
        prior=prior_of(wildcards),
        subject=SUBJECTS,
        shard=SHARDS,
    )

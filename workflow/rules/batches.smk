"""Jobs that serve several subjects of a large cohort, of stages whose work for one takes less than a process's start.

Such a job has the inputs, outputs and params of the rule of one subject, once for each of its subjects, numbered.
It has no wildcards, so Snakemake prefers it. Who is asked for alone on the command line is in no such job.
"""

from snakemake.iocontainers import Wildcards


def asked_alone():
    """Return the subjects of whom the command line asks for files that are not there yet."""
    of_subject = re.compile(
        rf"{re.escape(RESULTS)}/(?:.+/)?(?:cohort|subjects)/({'|'.join(map(re.escape, SUBJECTS))})/"
    )
    asked = [of_subject.match(name) for name in sys.argv[1:] if not Path(name).exists()]
    return {match[1] for match in asked if match}


def light_stages():
    """Yield the rule of each light stage, its wildcards beside the subject, and the subjects."""
    for experiment in [*FEATURE_EXPERIMENTS, *SPEED_EXPERIMENTS, *POPULATIONS]:
        of_all = STUDY.subjects_of(experiment)
        if experiment in FEATURE_EXPERIMENTS:
            stages = dict.fromkeys(["posterior", "predictive"], of_all)
        elif experiment in SPEED_EXPERIMENTS:
            stages = dict.fromkeys(
                ["exact_posterior", "verdict", "predictive_speeds"],
                of_all,
            )
        else:
            stages = {
                "population_answers": STUDY.answered(experiment),
                "pressures": STUDY.with_pressures(experiment),
            }
        for name, subjects in stages.items():
            yield name, {"experiment": experiment}, subjects


def of_one(item, wildcards):
    """Return an input or output of a rule as it is of one subject."""
    if callable(item):
        return item(wildcards)
    path = name_of(item).format(**dict(wildcards.items()))
    return ancient(path) if getattr(item, "flags", {}).get("ancient") else path


def name_of(pattern):
    """Return a pattern without the storage's prefix, which Snakemake puts before every name of an input."""
    stored = getattr(pattern, "flags", {}).get("storage_object")
    prefix = f"{workflow.storage_settings.default_storage_prefix}/"
    return stored.query.removeprefix(prefix) if stored else pattern


def numbered_inputs(inputs, members):
    """Return the named inputs of a rule for each member."""
    return {
        f"{name}_{number}": (
            of_one(item, wildcards)
            if isinstance(item, str) or callable(item)
            else [of_one(part, wildcards) for part in item]
        )
        for number, wildcards in enumerate(members)
        for name, item in inputs.items()
    }


def numbered_outputs(single, members):
    """Return the named outputs of a rule for each member, in their places in the report."""
    places = {
        name: getattr(item, "flags", {}).get("report")
        for name, item in single.rule.output.items()
    }
    return {
        f"{name}_{number}": reported(of_one(item, wildcards), places[name], wildcards)
        for number, wildcards in enumerate(members)
        for name, item in single.output.items()
    }


def reported(path, place, wildcards):
    """Return a path with the place in the report that a rule's output has, if any."""
    if place is None:
        return path

    def filled(words):
        return words.format(**dict(wildcards.items()))

    return report(
        path,
        caption=place.caption.get_path_or_uri(secret_free=True),
        category=filled(place.category),
        subcategory=filled(place.subcategory),
        labels=place.labels,
    )


ALONE = asked_alone()

for name, fixed, subjects in light_stages():
    for number, batch in enumerate(STUDY.batches(subjects)):
        if len(batch) == 1 or ALONE & set(batch):
            continue
        single = getattr(rules, name)
        job = "_".join([name, "batch", *fixed.values(), str(number)])
        members = [
            Wildcards(fromdict=fixed | {"subject": subject}) for subject in batch
        ]
        together = Wildcards(fromdict=fixed | {"subject": ", ".join(batch)})
        file = fixed | {"subject": f"batch-{number}"}

        rule:
            name:
                job
            input:
                **numbered_inputs(single.input, members),
            output:
                **numbered_outputs(single, members),
            log:
                str(single.log[0]).format(**file),
            priority: single.rule.priority
            resources:
                # of a profile for a cluster, which cannot name rules that depend on the cohort
                mem_mb=2000,
                runtime=5 + 2 * len(batch),
            params:
                stage=stage_of_several(name, members),
            message:
                single.rule.message.format(wildcards=together)
            script:
                "../scripts/stage.py"

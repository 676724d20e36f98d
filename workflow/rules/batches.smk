"""Jobs that serve several subjects, of stages whose work for one takes less than starting a process for it.

Such a job has the inputs, outputs and params of the rule of one subject, once for each of its subjects, numbered.
It has no wildcards, so Snakemake prefers it. Who is asked for alone on the command line is in no such job.
"""

from snakemake.iocontainers import Wildcards


def asked_alone():
    """Return the subjects of whom the command line asks for files that are not there yet."""
    of_subject = re.compile(
        rf"{re.escape(RESULTS)}/(?:.+/)?(?:cohort|subjects|cmaes)/({'|'.join(map(re.escape, SUBJECTS))})[/.]"
    )
    asked = [of_subject.match(name) for name in sys.argv[1:] if not Path(name).exists()]
    return {match[1] for match in asked if match}


def light_stages():
    """Yield the name of each rule of a light stage, its wildcards beside the subject, and the subjects."""
    for name, subjects in (("ingest", SUBJECTS), ("passive", SHOWN), ("cmaes", SHOWN)):
        yield name, {}, subjects
    for prior in dict.fromkeys(CONFIG.experiments[name].prior for name in EXPERIMENTS):
        users = [
            name for name in EXPERIMENTS if CONFIG.experiments[name].prior == prior
        ]
        subjects = [
            one
            for one in SUBJECTS
            if any(one in STUDY.subjects_of(name) for name in users)
        ]
        for shard in SHARDS:
            yield "simulate", {"prior": prior, "shard": str(shard)}, subjects
    for experiment in FEATURE_EXPERIMENTS:
        for name in ("posterior", "predictive", "subject_figures"):
            yield name, {"experiment": experiment}, STUDY.subjects_of(experiment)
    for experiment in SPEED_EXPERIMENTS:
        for name in ("exact_posterior", "verdict", "predictive_speeds"):
            yield name, {"experiment": experiment}, STUDY.subjects_of(experiment)
        yield "exact_subject_figures", {"experiment": experiment}, STUDY.subjects_of(
            experiment
        )
    for experiment in POPULATIONS:
        for name, subjects in (
            ("population_answers", STUDY.answered(experiment)),
            ("pressures", STUDY.with_pressures(experiment)),
            ("exact_subject_figures", shown_singly(experiment)),
        ):
            yield name, {"experiment": experiment}, subjects


def of_one(item, wildcards):
    """Return an input or output of a rule as it is of one subject; its place in the report goes along."""
    if callable(item):
        return item(wildcards)
    path = name_of(item).format(**dict(wildcards.items()))
    return ancient(path) if getattr(item, "flags", {}).get("ancient") else path


def reported(path, place, wildcards):
    """Return a path with the place that a rule's output has in the report, if any."""
    if place is None:
        return path

    def filled(words):
        return words.format(**dict(wildcards.items())) if words else words

    return report(
        path,
        caption=place.caption.get_path_or_uri(secret_free=True),
        category=filled(place.category),
        subcategory=filled(place.subcategory),
        labels=place.labels,
    )


def numbered(files, members, one):
    """Return the named files of a rule for each member, as ``run_job`` expects them of a job of several."""
    return {
        f"{name}_{number}": (
            one(item, wildcards)
            if isinstance(item, str) or callable(item)
            else [one(part, wildcards) for part in item]
        )
        for number, wildcards in enumerate(members)
        for name, item in files.items()
    }


ALONE = asked_alone()

for name, fixed, subjects in light_stages():
    for number, batch in enumerate(STUDY.batches(subjects)):
        if len(batch) == 1 or ALONE & set(batch):
            continue
        single = getattr(rules, name)
        members = [
            Wildcards(fromdict=fixed | {"subject": subject}) for subject in batch
        ]
        together = Wildcards(fromdict=fixed | {"subject": ", ".join(batch)})
        places = {
            output: getattr(item, "flags", {}).get("report")
            for output, item in single.rule.output.items()
        }
        file = fixed | {"subject": f"batch-{number}"}
        job = "_".join([name, *fixed.values(), f"batch_{number}"])
        OF_SEVERAL[job] = [name] * len(batch)

        rule:
            name:
                job
            input:
                **numbered(single.input, members, of_one),
            output:
                **{
                    f"{output}_{place}": reported(
                        of_one(item, wildcards), places[output], wildcards
                    )
                    for place, wildcards in enumerate(members)
                    for output, item in single.output.items()
                },
            log:
                str(single.log[0]).format(**file),
            benchmark:
                str(single.benchmark).format(**file)
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

"""What has changed between the first and the last visit of each person of `new_subjects.cohort`; not part of the study."""


rule person_change:
    """Two visits of a person outside the pool, answered by the network of the cohort, inferred together."""
    input:
        observations=of_visits("observation.h5"),
        posteriors=of_visits("posterior.h5"),
        supports=of_visits("support.json"),
        protocol=str(STUDY.new_protocol),
        estimator=FLOW,
        noise=rules.noise.output.noise,
        pooled_observations=of_experiment("cohort/{subject}/observation.h5"),
    output:
        joint=f"{OF_PERSON}/change.h5",
        table=f"{OF_PERSON}/change.csv",
        figure_pdf=f"{OF_PERSON}/change.pdf",
        figure_png=f"{OF_PERSON}/change.png",
        sheet=f"{OF_PERSON}/sheet.pdf",
    log:
        f"{RESULTS}/logs/person_change/{{experiment}}/{{person}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
        person=PERSONS,
    params:
        stage=stage_of_person,
    message:
        "What has changed in {wildcards.person}, by '{wildcards.experiment}'"
    script:
        "../scripts/stage.py"


use rule person_change as person_change_of_population with:
    input:
        observations=of_visits("observation.h5"),
        posteriors=of_visits("posterior.h5"),
        supports=of_visits("support.json"),
        protocol=str(STUDY.new_protocol),
        estimator=FLOW,
        noise=rules.noise.output.noise,
        pooled_observations=[],
    log:
        f"{RESULTS}/logs/person_change_of_population/{{experiment}}/{{person}}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
        person=PERSONS,


rule changes_table:
    input:
        tables=tables_of_persons,
    output:
        table=f"{RESULTS}/tables/changes.csv",
    log:
        f"{RESULTS}/logs/changes_table.log",
    params:
        stage=stage("changes_table"),
    message:
        "Table of what has changed in every person who came twice"
    script:
        "../scripts/stage.py"


rule change_groups:
    """What has changed in groups: mean and spread between persons, and how groups differ."""
    input:
        changes=of_pairs("change.h5"),
        observations=earlier_observations,
    output:
        groups=f"{RESULTS}/{{experiment}}/changes_groups.h5",
        table=f"{RESULTS}/{{experiment}}/changes_groups.csv",
        persons=f"{RESULTS}/{{experiment}}/changes_persons.csv",
        figure_pdf=f"{RESULTS}/figures/changes_groups-{{experiment}}.pdf",
        figure_png=f"{RESULTS}/figures/changes_groups-{{experiment}}.png",
    log:
        f"{RESULTS}/logs/change_groups/{{experiment}}.log",
    wildcard_constraints:
        experiment=f"{SPEEDS}|{OVER_POPULATION}",
    params:
        stage=stage("change_groups"),
    message:
        "What has changed in groups of persons, by '{wildcards.experiment}'"
    script:
        "../scripts/stage.py"


rule changes_groups_table:
    input:
        tables=tables_of_groups,
    output:
        table=f"{RESULTS}/tables/changes_groups.csv",
    log:
        f"{RESULTS}/logs/changes_groups_table.log",
    params:
        stage=stage("changes_groups_table"),
    message:
        "Table of what has changed in groups"
    script:
        "../scripts/stage.py"


rule changes:
    """Every person of `new_subjects.cohort` who came twice, first visit to last, and what groups of them say."""
    input:
        rules.changes_table.output.table,
        rules.changes_groups_table.output.table,

"""Subjects of `new_subjects.cohort`, answered by the network as it is; not part of the study."""

OF_NEW = f"{RESULTS}/{{experiment}}/new/{NEW_COHORT}/{{new_subject}}"
WITH_FIT = CONFIG.new_subjects.reference_fit
OUTPUTS_OF_NEW = {
    "observation": f"{OF_NEW}/observation.h5",
    "passive_baseline": f"{OF_NEW}/passive.h5" if WITH_FIT else [],
    "reference_fit": f"{OF_NEW}/cmaes.h5" if WITH_FIT else [],
    "shard": f"{OF_NEW}/simulations.h5",
    "posterior": f"{OF_NEW}/posterior.h5",
    "support": f"{OF_NEW}/support.json",
    "predictive": f"{OF_NEW}/predictive.h5",
    "ppc_png": f"{OF_NEW}/ppc.png",
    "posterior_png": f"{OF_NEW}/posterior.png",
    "sheet": f"{OF_NEW}/sheet.pdf",
}
# Outputs cannot depend on a wildcard, so who has cuff pressures has a rule of its own, and who is free-running.
NEW_FREE = free_running(STUDY)
NEW_FREE_BY_NETWORK = [
    name
    for name in NEW_FREE
    if network_of_pushes(STUDY, name, STUDY.answering_experiments)[0]
]
NEW_FREE_FROM_PRIOR = [name for name in NEW_FREE if name not in NEW_FREE_BY_NETWORK]
NEW_WITH_PRESSURES = [name for name in STUDY.new_with_pressures if name not in NEW_FREE]
NEW_ON_SPEEDS = [
    name for name in STUDY.new_rows if name not in (*NEW_WITH_PRESSURES, *NEW_FREE)
]
OUTPUTS_OF_FREE = {
    name: OUTPUTS_OF_NEW[name]
    for name in (
        "observation",
        "posterior",
        "support",
        "predictive",
        "ppc_png",
        "posterior_png",
        "sheet",
    )
}


rule new_subject:
    """Posterior, verdict and figures of a subject outside the pool; refused where the network cannot answer."""
    input:
        recording=lambda wildcards: str(STUDY.new_recording(wildcards.new_subject)),
        protocol=str(STUDY.new_protocol),
        estimator=FLOW,
        noise=rules.noise.output.noise,
        pooled_observations=of_experiment("cohort/{subject}/observation.h5"),
        misspecifications=of_experiment(
            "{experiment}/subjects/{subject}/misspecification.h5"
        ),
    output:
        **OUTPUTS_OF_NEW,
        with_pressures=[],
    log:
        f"{RESULTS}/logs/new_subject/{{experiment}}/{{new_subject}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
        new_subject="|".join(NEW_ON_SPEEDS) or NONE,
    params:
        stage=stage_of_new_subject("new_subject"),
    message:
        "The network of '{wildcards.experiment}' answers {wildcards.new_subject}"
    script:
        "../scripts/stage.py"


use rule new_subject as new_subject_with_pressures with:
    output:
        **OUTPUTS_OF_NEW,
        with_pressures=f"{OF_NEW}/with_pressures.h5",
    log:
        f"{RESULTS}/logs/new_subject_with_pressures/{{experiment}}/{{new_subject}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
        new_subject="|".join(NEW_WITH_PRESSURES) or NONE,


rule new_subject_of_population:
    """The same by the network of a population; refused outside its declared range."""
    input:
        recording=lambda wildcards: str(STUDY.new_recording(wildcards.new_subject)),
        protocol=str(STUDY.new_protocol),
        estimator=FLOW,
        noise=rules.noise.output.noise,
        null=rules.population_null.output.null,
    output:
        **OUTPUTS_OF_NEW,
        with_pressures=[],
    log:
        f"{RESULTS}/logs/new_subject_of_population/{{experiment}}/{{new_subject}}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
        new_subject="|".join(NEW_ON_SPEEDS) or NONE,
    params:
        stage=stage_of_new_subject("new_subject_of_population"),
    message:
        "The network of '{wildcards.experiment}' answers {wildcards.new_subject}"
    script:
        "../scripts/stage.py"


use rule new_subject_of_population as new_subject_of_population_with_pressures with:
    output:
        **OUTPUTS_OF_NEW,
        with_pressures=f"{OF_NEW}/with_pressures.h5",
    log:
        f"{RESULTS}/logs/new_subject_of_population_with_pressures/{{experiment}}/{{new_subject}}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
        new_subject="|".join(NEW_WITH_PRESSURES) or NONE,


rule new_free_subject:
    """Posterior, figures and page of a free-running recording outside the study, from the prior on."""
    input:
        recording=lambda wildcards: str(STUDY.new_recording(wildcards.new_subject)),
    output:
        **OUTPUTS_OF_FREE,
    log:
        f"{RESULTS}/logs/new_free_subject/{{experiment}}/{{new_subject}}.log",
    wildcard_constraints:
        experiment=f"{SPEEDS}|{OVER_POPULATION}",
        new_subject="|".join(NEW_FREE_FROM_PRIOR) or NONE,
    params:
        stage=stage_of_new_subject("free_subject"),
    message:
        "{wildcards.new_subject}, free-running, is answered under the prior of '{wildcards.experiment}'"
    script:
        "../scripts/stage.py"


rule new_free_subject_of_population:
    """The same by the network of a population, where one runs and knows such a heart."""
    input:
        recording=lambda wildcards: str(STUDY.new_recording(wildcards.new_subject)),
        estimator=FLOW,
    output:
        **OUTPUTS_OF_FREE,
    log:
        f"{RESULTS}/logs/new_free_subject_of_population/{{experiment}}/{{new_subject}}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
        new_subject="|".join(NEW_FREE_BY_NETWORK) or NONE,
    params:
        stage=stage_of_new_subject("free_subject_of_population"),
    message:
        "The network of '{wildcards.experiment}' answers {wildcards.new_subject}, free-running"
    script:
        "../scripts/stage.py"


rule new_answers:
    """A row for each subject and experiment; a refused subject is a row with its reason, and no job."""
    input:
        posteriors=of_answered_outside("posterior.h5"),
        supports=of_answered_outside("support.json"),
    output:
        table=f"{RESULTS}/new/{NEW_COHORT}/answers.csv",
        workbook=f"{RESULTS}/new/{NEW_COHORT}/answers.xlsx",
    log:
        f"{RESULTS}/logs/new_answers/{NEW_COHORT}.log",
    params:
        stage=stage("new_answers"),
    message:
        "Table of the answers to the subjects of '{NEW_COHORT}'"
    script:
        "../scripts/stage.py"


rule new_subjects:
    """Every subject of `new_subjects.cohort`, in every experiment that runs and can answer, and their table."""
    input:
        rules.new_answers.output.table,

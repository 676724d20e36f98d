"""The small exam of development: a few hearts of its own, as the exam itself (`make exam`) no part of the study."""


rule small_exam_answers:
    input:
        estimator=f"{RESULTS}/{EXAMINED}/flow.h5",
        noise=rules.noise.output.noise,
        null=f"{RESULTS}/{EXAMINED}/null.h5",
    output:
        answers=f"{RESULTS}/{EXAMINED}/small_exam/cohort/{{generator}}.h5",
    log:
        f"{RESULTS}/logs/small_exam_answers/{{generator}}.log",
    wildcard_constraints:
        generator="|".join(CONFIG.exam.small_hearts),
    params:
        stage=stage("exam_answers", stream="small_exam"),
    message:
        "Hearts of generator '{wildcards.generator}' in the small exam (progress below)"
    script:
        "../scripts/stage.py"


rule small_exam:
    input:
        answers=expand(
            rules.small_exam_answers.output.answers,
            generator=CONFIG.exam.small_hearts,
        ),
    output:
        table=f"{RESULTS}/tables/small_exam.csv",
        samplers=f"{RESULTS}/tables/small_exam_samplers.csv",
        figure_pdf=f"{RESULTS}/figures/small_exam.pdf",
        figure_png=f"{RESULTS}/figures/small_exam.png",
    log:
        f"{RESULTS}/logs/small_exam.log",
    params:
        stage=stage("exam_table"),
    message:
        "Tables and figure of the small exam"
    script:
        "../scripts/stage.py"

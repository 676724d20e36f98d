"""Raw recordings -> observed curves and passive baselines."""


rule ingest:
    """Quality control, mean speed at each phase, E = 3 rho c^2, periodic curve.

    The subject's row of subjects.csv travels in the params, so editing one row touches one subject.
    """
    input:
        table=lambda wildcards: str(STUDY.cohort.recording(wildcards.subject)),
        subjects=ancient(str(STUDY.cohort.folder / "subjects.csv")),
    output:
        observation=OBSERVATION,
    log:
        "<results>/logs/ingest/{subject}.log",
    params:
        **stage("swesbi.recording.cohort.observed:observed_curve"),
    script:
        "../scripts/stage.py"


rule passive:
    """Passive baseline along the stretch of a reference beat, scaled to the late-diastolic stiffness."""
    input:
        observation=OBSERVATION,
    output:
        passive=PASSIVE,
    log:
        "<results>/logs/passive/{subject}.log",
    params:
        **stage("swesbi.measurement.baseline:calibrated_passive"),
    script:
        "../scripts/stage.py"


rule noise:
    """Noise between repeats, samples and sweeps, by a mixed model over all recordings."""
    input:
        tables=[str(STUDY.cohort.recording(subject)) for subject in SUBJECTS],
        observations=expand(OBSERVATION, subject=SUBJECTS),
        protocol=str(STUDY.cohort.folder / "recording.yaml"),
    output:
        noise=NOISE,
        contexts="<results>/cohort/contexts.h5",
    log:
        "<results>/logs/noise.log",
    params:
        **stage("swesbi.recording.cohort.observed:cohort_noise"),
    script:
        "../scripts/stage.py"

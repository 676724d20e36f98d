"""Which subjects outside the study an experiment cannot answer, told before anything is computed."""

from __future__ import annotations

from swesbi.config.study import Study


def context_refusal(study: Study, experiment: str, subject: str) -> str:
    """Return why the network of an experiment cannot answer for a subject's heart; empty where it can."""
    # SciPy's distributions take a while to import, and most who read the configuration ask nothing of it
    from swesbi.verdict.context import declared_refusal, refusal

    context = study.outside.rows[subject].to_context()
    populations = study.config.population_experiments
    if experiment in populations:
        return declared_refusal(context, populations[experiment].population)
    trained = [study.cohort.rows[name].to_context() for name in study.subjects_of(experiment)]
    return refusal(context, trained, study.config.new_subjects.margin_fraction)


def values_in(refusal: str) -> list[str]:
    """Return the values that a refusal lists, each with the range that it lies outside."""
    return [line[4:] for line in refusal.splitlines() if line.startswith("  - ")]


def why_in_short(refusal: str) -> str:
    """Return a refusal in a few words: of a list the values alone."""
    values = ", ".join(values_in(refusal))
    return f"does not know such a heart ({values})" if values else refusal

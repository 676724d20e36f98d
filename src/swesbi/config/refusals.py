"""Which subjects outside the study an experiment cannot answer, told before anything is computed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from swesbi.config.study import Study


def context_refusal(study: Study, experiment: str, subject: str) -> str:
    """Return why the network of an experiment cannot answer for a subject's heart; empty where it can."""
    # SciPy's distributions take a while to import, and most who read the configuration ask nothing of it
    from swesbi.verdict.context import ContextRefusedError, check_context, check_declared

    context = study.new_rows[subject].to_context()
    populations = study.config.population_experiments
    try:
        if experiment in populations:
            check_declared(context, populations[experiment].population)
        else:
            trained = [study.context_rows[name].to_context() for name in study.subjects_of(experiment)]
            check_context(context, trained, study.config.new_subjects.margin_fraction)
    except ContextRefusedError as error:
        return str(error)
    return ""


def why_in_short(refusal: str) -> str:
    """Return the values of a refusal, which stand in its list."""
    return ", ".join(line[4:] for line in refusal.splitlines() if line.startswith("  - "))


def network_of_pushes(
    study: Study, subject: str, experiments: Sequence[str], lacking: Callable[[str], str] = lambda name: ""
) -> tuple[str, str]:
    """Return the first experiment whose network can answer a free-running recording, or none and why.

    Only the network of a population takes any set of pushes, and must know such a heart.

    Args:
        study: The study.
        subject: Whose recording.
        experiments: Those that may answer.
        lacking: Why the network of an experiment is not there; empty where it is, or will be.
    """
    able = [name for name in experiments if name in study.config.population_experiments]
    reasons = [] if able else [f"{' and '.join(experiments)} has no network that takes pushes"]
    for name in able:
        if refusal := context_refusal(study, name, subject):
            reasons.append(f"{name} does not know such a heart ({why_in_short(refusal)})")
        elif absent := lacking(name):
            reasons.append(absent)
        else:
            return name, ""
    return "", "; ".join(reasons)


def trained_on(study: Study, experiment: str, subject: str) -> str:
    """Return where the answer to a subject lies whom the network was trained on; empty for any other."""
    same = study.new_cohort.resolve() == study.cohort.resolve()
    if not same or subject not in study.subjects_of(experiment):
        return ""
    return (
        f"subject = {subject!r}: is in the cohort that the network was trained on; its answer is in "
        f"{study.config.results}/<experiment>/subjects/{subject}/"
    )

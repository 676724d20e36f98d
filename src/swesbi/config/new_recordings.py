"""What the recordings of subjects outside the study say of themselves, beside what their cohort says."""

from __future__ import annotations

from swesbi.config.study import Study
from swesbi.recording.protocol import read_noise_declaration, read_protocol, with_own_phases
from swesbi.recording.settings import NoiseDeclaration, RecordingSettings


def quality_of(study: Study, subject: str) -> RecordingSettings:
    """Return quality control of a recording outside the study, with as many phases as it says it has.

    Raises:
        RecordingError: ``recording.yaml`` or the recording's own file cannot be used, or says otherwise.
    """
    settings, phases = study.config.recording, study.config.new_subjects.phases
    settings = settings.model_copy(update={"phases": phases or settings.phases})
    settings = with_own_phases(study.new_protocol, subject, settings)
    read_protocol(study.new_cohort, settings, subject)
    return settings


def noise_declared(study: Study, subject: str) -> NoiseDeclaration:
    """Return what is declared of the errors of a recording outside the study.

    Raises:
        RecordingError: What is said cannot be used.
    """
    return read_noise_declaration(study.new_protocol, subject)


def is_free_running(study: Study, subject: str) -> bool:
    """Tell whether a recording outside the study is free-running.

    Raises:
        RecordingError: There is no such recording, or its own file cannot be used.
    """
    # reading tables imports pandas, and most who read the configuration ask nothing of it
    from swesbi.recording.foreign import is_free

    return is_free(study.new_recording(subject), study.new_layout_of(subject))

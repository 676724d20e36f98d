"""The schema of the cohort's noise."""

from swesbi.artefacts.variable import Variable

_SD = "relative standard deviation of the speed"

SCHEMAS = {
    "noise": {
        "/": {
            "component": Variable(("component",), "1", "between repeats, between samples of a repeat"),
            "subject": Variable(("subject",), "1", "subjects of the cohort"),
            "fraction": Variable(("component",), "1", f"{_SD}, common to the cohort"),
            "standard_error": Variable(("component",), "1", "its standard error, NaN at zero"),
            "low": Variable(("component",), "1", "lower limit of its profile-likelihood interval"),
            "high": Variable(("component",), "1", "upper limit"),
            "repeats": Variable((), "1", "repeats with accepted samples"),
            "samples": Variable((), "1", "accepted samples"),
            "subject_fraction": Variable(("subject", "component"), "1", f"{_SD}, of one recording alone"),
            "subject_standard_error": Variable(("subject", "component"), "1", "its standard error"),
            "subject_low": Variable(("subject", "component"), "1", "lower limit of its interval"),
            "subject_high": Variable(("subject", "component"), "1", "upper limit"),
            "subject_repeats": Variable(("subject",), "1", "repeats with accepted samples"),
            "subject_samples": Variable(("subject",), "1", "accepted samples"),
            "interval": Variable((), "1", "mass of the intervals"),
            "homogeneity_p": Variable((), "1", "p-value: all recordings share their components"),
        }
    }
}

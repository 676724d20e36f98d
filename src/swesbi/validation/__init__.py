"""Checking a cohort of recordings before anything runs on it, and starting a new one."""

from swesbi.validation.cohort import Checked, CohortReport, examine_cohort

__all__ = ["Checked", "CohortReport", "examine_cohort"]

"""How far the model may miss the truth: delta and tau chosen on a generated cohort with known model error.

None of its subjects is in the study's cohort.
"""

from swesbi.discrepancy.cohort import GeneratedSubject, generate_cohort
from swesbi.discrepancy.evidence import PairScore, score_subject
from swesbi.discrepancy.settings import DiscrepancyStudySettings
from swesbi.discrepancy.table import best_pair, discrepancy_table

__all__ = [
    "DiscrepancyStudySettings",
    "GeneratedSubject",
    "PairScore",
    "best_pair",
    "discrepancy_table",
    "generate_cohort",
    "score_subject",
]

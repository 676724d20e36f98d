"""The passes of sbi's training written out: equal up to rounding, faster; ``procedure: sbi`` does without."""

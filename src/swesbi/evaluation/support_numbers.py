"""Prior support in a few words, for figures and tables."""

from __future__ import annotations

from swesbi.inference.support import Support


def support_numbers(support: Support) -> tuple[str, str]:
    """Return the two numbers that decide on prior support: draws within the bounds, largest |z|."""
    plural = "draw" if support.in_prior_draws == 1 else "draws"
    return f"{support.in_prior_draws:,} in-prior {plural}", f"max |z| = {support.max_abs_z:.2f}"

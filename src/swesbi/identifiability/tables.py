"""The tables of the study of identifiability, from its artefact."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd
import xarray as xr

from swesbi.identifiability.laplace import interval_fold

PLACEMENTS: Final = ("even", "chosen")


def summary_table(root: xr.Dataset, profile: xr.Dataset) -> pd.DataFrame:
    """Return one row a subject and quantity: contraction, spread found and expected, likelihood interval.

    The attained stiffness is no parameter: its likelihood columns are empty.
    """
    names = ["median", "sd_log", "contraction", "contraction_log", "expected_sd_log"]
    table = root[names].to_dataframe().reset_index()
    table["expected_over_found"] = table["expected_sd_log"] / table["sd_log"]
    keys = ["subject", "quantity"]
    likelihood = profile["maximum_phi"].to_dataframe(name="maximum_likelihood")
    for bound, column in (("lower", "likelihood_low"), ("upper", "likelihood_high")):
        likelihood[column] = profile["interval"].sel(bound=bound, drop=True).to_dataframe(name=column)
        open_end = profile["closed"].sel(bound=bound, drop=True).to_dataframe(name="closed") == 0
        likelihood[f"{column}_open"] = open_end
    likelihood = likelihood.reset_index().rename(columns={"parameter": "quantity"})
    return table[keys + [name for name in table if name not in keys]].merge(likelihood, "left", on=keys)


def information_table(phases: xr.Dataset) -> pd.DataFrame:
    """Return one row a subject, quantity and measured phase: what it tells, and the posterior without it."""
    table = phases.to_dataframe().reset_index().rename(columns={"phase": "position", "phase_of": "phase"})
    table = table[table["measured"] == 1].sort_values(["subject", "quantity", "position"], kind="stable")
    columns = ["share", "expected_sd_increase", "left_out_sd_increase", "left_out_mean_shift", "k_hat"]
    return table[["subject", "quantity", "position", "phase", *columns]].reset_index(drop=True)


def design_table(design: xr.Dataset, placement: xr.Dataset, mass: float) -> pd.DataFrame:
    """Return one row a subject, quantity and design; ``repeats`` is "inf" for the discrepancy's floor.

    ``fold`` is the upper over the lower end of the expected credible interval. ``model_errors`` says
    whether those of near phases are correlated or all are independent. Chosen phases are compared at the
    repeats of the recordings themselves.
    """
    parts = [
        _evenly(design, sd, floor).assign(model_errors=errors)
        for sd, floor, errors in (
            ("sd_log", "floor", "correlated"),
            ("sd_log_independent", "floor_independent", "independent"),
        )
    ]
    table = pd.concat([*parts, _placed(design, placement)], ignore_index=True)
    table["fold"] = interval_fold(table["sd_log"].to_numpy(), mass)
    order = ["subject", "quantity", "placement", "model_errors", "phases", "repeats", "sd_log", "fold"]
    return table[order].sort_values(order[:6], kind="stable").reset_index(drop=True)


def _evenly(design: xr.Dataset, sd: str, floor: str) -> pd.DataFrame:
    rows = design[sd].to_dataframe(name="sd_log").reset_index()
    without_noise = design[floor].to_dataframe(name="sd_log").reset_index().assign(repeats=np.inf)
    return pd.concat([rows, without_noise], ignore_index=True).assign(placement=PLACEMENTS[0])


def _placed(design: xr.Dataset, placement: xr.Dataset) -> pd.DataFrame:
    rows = placement["sd_log"].to_dataframe(name="sd_log").reset_index().rename(columns={"placed": "phases"})
    repeats = design["own_repeats"].to_series().rename("repeats")
    return rows.join(repeats, on="subject").assign(placement=PLACEMENTS[1], model_errors="correlated")

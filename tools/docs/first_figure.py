"""The README's picture: one volunteer, from recording to posterior."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import gaussian_kde

from swesbi.base.arrays import FloatArray
from swesbi.config.study import Study
from swesbi.report.figures.style import POSTERIOR, TRUTH, new_figure, style

SUBJECT: Final = "G"
EXPERIMENT: Final = "calibrated"
PARAMETERS: Final = {
    "k0_kpa": "How strongly it contracts\n$k_0$ (kPa)",
    "k_atp_per_s": "How fast it contracts\n$k_{\\mathrm{ATP}}$ (s$^{-1}$)",
    "k_sr_per_s": "How fast it relaxes\n$k_{\\mathrm{SR}}$ (s$^{-1}$)",
}
INTERVAL: Final = (5.0, 95.0)


def first_figure(study: Study) -> Figure:
    """Return recording, prediction and three posteriors of a volunteer, beside the true parameters.

    Raises:
        FileNotFoundError: The study has no such posterior.
    """
    folder = Path(study.config.results) / EXPERIMENT / "subjects" / SUBJECT
    with style():
        figure = new_figure(7.0, 3.9)
        axes = figure.subplot_mosaic([["recording"] * 3, list(PARAMETERS)], height_ratios=(1.3, 1.0))
        with xr.open_datatree(folder / "predictive.h5", engine="h5netcdf") as predictive:
            _draw_recording(axes["recording"], predictive)
        table = pd.read_csv(study.cohort.folder / "truth.csv", index_col="subject")
        with xr.open_datatree(folder / "posterior.h5", engine="h5netcdf") as posterior:
            for name, label in PARAMETERS.items():
                draws = posterior["posterior"][name].to_numpy().ravel()
                _draw_posterior(axes[name], draws, float(table[name][SUBJECT]), label)
        shown = axes["k0_kpa"].get_legend_handles_labels()
        figure.legend(*shown, loc="outside lower center", ncols=3)
    return figure


def _draw_recording(axes: Axes, predictive: xr.DataTree) -> None:
    grid, phase = (100.0 * predictive[name].to_numpy() for name in ("grid", "phase"))
    after = predictive["posterior"]
    low, high = after["observed_low_kpa"].to_numpy(), after["observed_high_kpa"].to_numpy()
    axes.fill_between(
        grid, low, high, color=POSTERIOR, alpha=0.25, lw=0, label="predicted by the fitted model, 90 %"
    )
    axes.plot(grid, after["observed_median_kpa"], color=POSTERIOR)
    axes.errorbar(
        phase,
        predictive["stiffness_kpa"],
        yerr=predictive["stiffness_se_kpa"],
        fmt="o",
        color="black",
        ms=3,
        label="measured stiffness, ± standard error",
    )
    axes.set(xlim=(0.0, 100.0), ylim=(0.0, None), ylabel="stiffness of the heart wall (kPa)")
    axes.set_xlabel("percent of the heart cycle, from the R peak")
    axes.set_title("One recording: the wall stiffens as the muscle contracts, and softens as it relaxes")
    axes.legend(loc="upper right")


def _draw_posterior(axes: Axes, draws: FloatArray, true: float, label: str) -> None:
    density = gaussian_kde(draws)
    first, low, high, last = np.percentile(draws, (0.2, *INTERVAL, 99.8))
    at = np.linspace(first, last, 300)
    inside = (at >= low) & (at <= high)
    axes.plot(at, density(at), color=POSTERIOR, label="posterior")
    axes.fill_between(
        at[inside], density(at[inside]), color=POSTERIOR, alpha=0.25, lw=0, label="90 % credible interval"
    )
    axes.axvline(true, color=TRUTH, ls="--", label="true value")
    axes.set(ylim=(0.0, None), yticks=[], xlabel=label)
    axes.set_title(f"{np.median(draws):.3g}  ({low:.3g} to {high:.3g})")

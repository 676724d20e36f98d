"""Which passive law answers hearts of laws that it is not? Decided on hearts of development.

    python -m studies.validation.development --csv studies/validation/tables/development.csv

Hearts of the stream of development (README.md), none of the validation, are recorded and answered by adaptive
importance sampling from the prior, no network in between, under each of ``laws``. A heart passes where the
posterior predictive chi2 has p >= .05, which stands in for the verdict. The table has a row a law and
generator: how many hearts, how many pass, how many press on a bound of the prior, and of those that pass the
shares whose true value lies in the interval. It has the share missed (shown stiffness or k_SR outside), the
same without those at a bound, median widths in log, and the mean log evidence.
Answers are kept in a file, so that a stopped run goes on. Takes some 3 s a heart and law on one core.
"""

from __future__ import annotations

import argparse
import json
import logging
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from studies.validation.former_law import FormerLaw, changed, former_law
from studies.validation.score import intervals, truths
from studies.validation.settings import configured
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import FloatArray
from swesbi.config.read import read_merged
from swesbi.config.slices import fields_of
from swesbi.config.study import Study, load_study
from swesbi.draws import resampled_rows
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, residuals
from swesbi.measurement.speeds import SpeedRecording, measured_speeds
from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import asking
from swesbi.prior import ParameterPrior
from swesbi.recording.speed import NoiseComponents
from swesbi.report.tables.validation_outcomes import QUANTITIES, SCORED
from swesbi.seeds import generator as stream_of
from swesbi.seeds import integer_seed
from swesbi.verdict.checks import residuals_p_value, strip_ratios
from swesbi.virtual.hearts.generators import all_generators, generator_of
from swesbi.virtual.hearts.heart import Generator, OtherHeart
from swesbi.virtual.hearts.recorded import record_heart

STREAM: Final = "development"
HEARTS: Final = {"a": 20, "b": 20, "e": 10, "f": 10, "u": 20, "v": 20, "w": 20, "x": 20, "y": 20, "z": 20}
"""Of each generator; ten are stored of (e) and (f)."""
DRAWS: Final = 1000
PASSES: Final = 0.05
AT_BOUND: Final = 2.26
"""Posterior over prior mass at all bounds from which on a heart presses on them; of the model 1 in 20."""
Law = Callable[[SpeedRecording], SpeedModel | FormerLaw]


def main() -> None:
    """Answer the hearts of every generator under every law; print and write what comes of it."""
    arguments = _arguments()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    study = load_study(read_merged(arguments.config))
    answers = Answers(study, arguments.kept)
    for letter in arguments.generators:
        for number in range(arguments.hearts or HEARTS[letter]):
            answers.ask(letter, number, arguments.laws)
    frame = summary(pd.DataFrame(answers.rows))
    print(frame.to_string(index=False, float_format="%.3g"))
    if arguments.csv:
        write_csv(arguments.csv, frame)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--generators", nargs="+", choices=HEARTS, default=list(HEARTS), help="letters; all")
    parser.add_argument("--laws", nargs="+", help="names of laws; all, if not given")
    parser.add_argument("--hearts", type=int, help="how many of each generator; 10 or 20, if not given")
    parser.add_argument("--kept", type=Path, default=Path("development.jsonl"), help="answers so far")
    parser.add_argument("--csv", type=Path, help="table to write, a row a law and generator")
    return parser.parse_args()


def laws(shipped: SpeedModelSettings) -> Mapping[str, Law]:
    """Return the shipped model, and others that differ in one thing, by name."""
    narrower = {
        "passive_ratio": ParameterPrior(centre=0.67, log_sd=0.9, low=0.045, high=9.97),
        "passive_middle_factor": ParameterPrior(centre=1.0, log_sd=0.25, low=0.472, high=2.117),
    }
    return {
        "former": partial(former_law, shipped=shipped),
        "no length dependence": partial(SpeedModel, settings=changed(shipped, {"length_dependence": None})),
        "narrower": partial(SpeedModel, settings=changed(shipped, narrower)),
        "shipped": partial(SpeedModel, settings=shipped),
    }


class Answers:
    """Answers to hearts of development under several laws, kept in a file of lines.

    Args:
        study: Its settings and seed.
        kept: File of the answers so far; one line each.
    """

    def __init__(self, study: Study, kept: Path) -> None:
        self.study, self.kept = study, kept
        exact = study.config.speed_experiments["calibrated"].exact
        self.exact = asking(exact, exact.min_effective_draws)
        plain = fields_of(study, {"experiment": "calibrated"}, "model")["model"]
        self.laws = laws(SpeedModelSettings.from_plain(plain))
        lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
        self.rows: list[dict[str, Any]] = [json.loads(line) for line in lines]
        self.generators = _generators(study)

    def ask(self, letter: str, number: int, names: list[str] | None) -> None:
        """Answer a heart under each law of these names under which it has no answer yet."""
        known = {row["law"] for row in self.rows if (row["generator"], row["number"]) == (letter, number)}
        wanted = [name for name in self.laws if name not in known and (names is None or name in names)]
        if not wanted:
            return
        config, made_by = self.study.config, generator_of(self.generators, letter)
        grid_points = config.measurement.grid_points
        made = record_heart(made_by, number, config.seed, STREAM, config.recording, grid_points)
        protocol = made_by.acquisition
        noise = NoiseComponents(
            protocol.repeat_sd_fraction, protocol.sample_sd_fraction, protocol.sweep_fraction
        )
        recording = measured_speeds(made.observation, noise)
        for name in wanted:
            row = {"generator": letter, "number": number, "law": name}
            row |= self.answer(made.heart, self.laws[name](recording), name)
            self.rows.append(row)
            with self.kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            logging.info("%s %d, %s: passes %s", letter, number, name, row["passes"])

    def answer(self, heart: OtherHeart, model: SpeedModel | FormerLaw, name: str) -> dict[str, Any]:
        """Return what the posterior of a heart says, beside the truth."""
        seed = integer_seed(self.study.config.seed, "development", name, heart.context.subject)
        seen = model if isinstance(model, FormerLaw) else HeartModel(model)
        *_, adapted = adaptive_rounds(seen, self.exact, seed)
        weighted = adapted.weighted
        rows = resampled_rows(weighted.weight, DRAWS, stream_of(seed, "draws"))
        phi = weighted.phi[rows]
        found, truth = intervals(model, phi, self.exact.interval), truths(heart)
        inside = (truth >= found.low) & (truth <= found.high)
        z = residuals(model.predict(phi), model.recording, model.settings.discrepancy)
        p_value = residuals_p_value((z**2).sum(axis=1), z.shape[1])
        return {
            "reliable": bool(adapted.reliable),
            "simulations": len(weighted.phi),
            "log_evidence": float(weighted.log_evidence),
            "passes": bool(p_value >= PASSES),
            "ratio_at_bound": _ratio_at_bound(model, weighted.phi, weighted.weight),
            "inside": {
                q: bool(x) for q, x, t in zip(QUANTITIES, inside, truth, strict=True) if np.isfinite(t)
            },
            "width": dict(zip(QUANTITIES, np.log(found.high / found.low).tolist(), strict=True)),
        }


def _ratio_at_bound(model: SpeedModel | FormerLaw, phi: FloatArray, weight: FloatArray) -> float:
    """Return posterior over prior mass at the faces of the box, averaged over all."""
    if isinstance(model, FormerLaw):
        return float("nan")
    return float(np.nanmean(strip_ratios(phi, weight, model.settings.prior)))


def _generators(study: Study) -> Mapping[str, Generator]:
    population = study.config.population_experiments[configured().experiment]
    base = study.config.speed_experiments[population.base]
    prior, measured = (
        study.config.priors[base.prior],
        base.misspecification.rule.volumes.lvesv_tolerance_fraction,
    )
    return all_generators(population.population, prior, study.config.acquisition, measured)


def summary(answers: pd.DataFrame) -> pd.DataFrame:
    """Return a row a law and generator, and a row of all generators; shares are of the hearts that pass."""
    frames = [*answers.groupby(["law", "generator"], sort=False)]
    frames += [((law, "all"), part) for law, part in answers.groupby("law", sort=False)]
    return pd.DataFrame([{"law": law, "generator": letter} | _row(part) for (law, letter), part in frames])


def _row(part: pd.DataFrame) -> dict[str, float]:
    inside = list(part.loc[part["passes"].astype(bool), "inside"])
    missed = np.array([not all(one.get(name, True) for name in QUANTITIES[:SCORED]) for one in inside])
    pressing = part["ratio_at_bound"].to_numpy(np.float64) >= AT_BOUND
    free = ~pressing[part["passes"].to_numpy(bool)]
    covered = {f"covered_{name}": _share([one[name] for one in inside if name in one]) for name in QUANTITIES}
    widths = {
        f"width_log_{name}": float(np.median([one[name] for one in part["width"]]))
        for name in QUANTITIES[:SCORED]
    }
    return {
        "hearts": len(part),
        "passed": len(inside),
        "missed": _share(missed.tolist()),
        "at_bound": int(pressing.sum()),
        "missed_not_at_bound": _share(missed[free].tolist()),
        **covered,
        **widths,
        "log_evidence": float(part["log_evidence"].mean()),
        "simulations": float(part["simulations"].median()),
        "reliable": _share(part["reliable"].tolist()),
    }


def _share(values: list[bool]) -> float:
    return float(np.mean(values)) if values else float("nan")


if __name__ == "__main__":
    main()

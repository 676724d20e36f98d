r"""Whether the joint posterior of two visits of a person is right, what it is worth, and what it costs.

    python -m studies.validation.change_pairs --pairs 200 --verdicts --out change_pairs.csv
    python -m studies.validation.change_pairs --stream development --pairs 40 --shares .9,.8 .95,.9

Needs a finished study of the shipped configuration. Persons are hearts of generator (b)
(README.md: physiology from ranges twice as wide in log as the study's), drawn from streams of their own:
none of them is of the validation itself. Each is recorded twice, both recordings are answered by the
network of its experiment as `infer` answers, and the pair as `python -m swesbi compare` does.

changed: theta is multiplied by factors uniform in their logarithm between 1/1.5 and 1.5, one each.
  Physiology, geometry, passive scale and the scale of the speeds stay; heart rate, R_d, C_s and stressed
  volume are the day's.
unchanged: the same with one theta at both visits.
half_redrawn: as `changed`, with half of the variance of physiology and of the scale of the speeds drawn anew
  at each visit, so that the normal scores of two visits have a correlation of .5. Every other pair keeps its
  theta: false change is counted there.
drug_on_alpha: as `changed`, alpha being 1.2 times as large at the second visit; every other pair keeps its
  theta.
strangers: the second recording is of another heart in the context of the first. Only the test that both are
  of one person is made, which takes their own posteriors.
power: k_SR is 0.75 times as large at the second visit, and nothing else of theta changes.

From visit to visit heart rate and loading scatter about the person's own as in the virtual trial (6 % and
8 %, `swesbi.virtual.trial.settings`), so that two visits differ by 1.4 times that; the stressed volume, which
the model holds fixed, by 5 %: half of what blood volume differs by between persons of one size (Feldschuh and
Enson, Circulation 1977;56:605; chosen).

`--shares A,B` infers with other shares than `changes.shares`: A of what is of the organ, B of the scale of
the speeds and of the discrepancy. Recordings and their own posteriors are made once for all of them. Shares
may be chosen on pairs of development alone, so the other stream takes none. `--verdicts` judges every
recording too.

Pairs are kept under `<results>/<experiment>/change_pairs/`, a file each: what was stopped goes on where it
was. No number but seconds depends on `--cores`. Beside the table stand `..._flags.csv` and `..._costs.csv`.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import logging
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Final

import pandas as pd

from studies.validation.answers import asked_of
from studies.validation.pair_answers import Answerer, Key
from studies.validation.pair_rates import costs, flags, one_row_a_pair, rates
from studies.validation.pairs import VARIANTS, Spreads
from studies.validation.settings import configured as configured_validation
from swesbi.artefacts import write_json
from swesbi.artefacts.csv import read_csv, write_csv
from swesbi.base.processes import WorkerKilledError, side_by_side
from swesbi.base.progress import Progress
from swesbi.config.read import at_configuration, in_words, read_merged, snakemake_options
from swesbi.config.study import Study, load_study
from swesbi.persons.change.settings import DISCREPANCY, ChangeSettings
from swesbi.study.finished import check_finished, finished_population
from swesbi.study.other_network import check_network
from swesbi.study.parsers import add_options
from swesbi.study.registry import stage_code
from swesbi.virtual.trial.settings import TRIAL

LETTER: Final = "b"
DEVELOPMENT: Final = "development"
STREAMS: Final = {"fresh": "change pairs", DEVELOPMENT: "development change pairs"}
"""Names of the random streams, none of them that of the validation."""
SPREADS: Final = Spreads(TRIAL.heart_rate_spread, TRIAL.loading_spread, stressed_volume=0.05)
CONFIGURED: Final = "configured"
CODE: Final = ("studies.validation.stages:validation_answers", "person_change")
"""Stages whose code the pairs depend on."""
ANEW: Final = ("speed_scale", DISCREPANCY)
"""Shares of what the investigator, or the day, sets anew."""


def with_shares(configured: ChangeSettings, text: str) -> ChangeSettings:
    """Return the settings with other shares: "A,B", of the organ and of what is set anew.

    Raises:
        ValueError: The text says no two shares.
    """
    try:
        organ, anew = map(float, text.split(","))
    except ValueError:
        raise ValueError(
            f"--shares {text}: needs two numbers, of the organ and of what is set anew: .9,.8"
        ) from None
    other = {name: anew if name in ANEW else organ for name in configured.shares.by_name}
    return ChangeSettings.from_plain({**configured.to_plain(), "shares": other})


def answerer(study: Study, options: argparse.Namespace) -> Answerer:
    """Return what answers the pairs that are asked for.

    Raises:
        OtherNetworkError: The network was trained under other settings.
        OSError: The study has not been run this far.
    """
    folder = options.results or Path(study.config.results)
    finished = finished_population(folder, configured_validation().experiment)
    check_finished(finished, snakemake_options(options.config, options.overlay))
    settings = asked_of(study, LETTER, 1, STREAMS[options.stream])
    check_network(finished.estimator, settings.train_population.to_plain())
    configured = study.config.changes
    changes = {name: with_shares(configured, name) for name in options.shares} or {CONFIGURED: configured}
    return Answerer(settings, SPREADS, study.config.seed, changes, finished, options.verdicts)


class Store:
    """Rows of pairs, a file each, made under one set of settings and by one network."""

    def __init__(self, folder: Path, made_of: Mapping[str, Any]) -> None:
        """Open a folder.

        Raises:
            ValueError: It holds pairs that were made otherwise.
        """
        self.folder, mark = folder, folder / "made_of.json"
        text = json.loads(json.dumps(made_of))
        if mark.is_file() and json.loads(mark.read_text(encoding="utf-8")) != text:
            raise ValueError(
                f"{folder}: holds pairs made under other settings or by other code; move it away"
            )
        folder.mkdir(parents=True, exist_ok=True)
        write_json(mark, text)

    def path(self, key: Key) -> Path:
        """Return where the rows of a pair lie."""
        shares, variant, number = key
        return self.folder / shares / variant / f"{number + 1:04d}.csv"

    def has(self, key: Key, verdicts: bool) -> bool:
        """Return whether a pair is there, judged if that is asked for."""
        return self.path(key).is_file() and (not verdicts or self._judged(key))

    def _judged(self, key: Key) -> bool:
        rows = self.read([key])
        return bool((rows["not_contradicted"] != "").all() or (rows["failure"] != "").all())

    def write(self, key: Key, rows: pd.DataFrame) -> None:
        """Keep the rows of a pair."""
        self.path(key).parent.mkdir(parents=True, exist_ok=True)
        write_csv(self.path(key), rows)

    def read(self, keys: Sequence[Key]) -> pd.DataFrame:
        """Return the rows of these pairs, in their order."""
        texts = ("shares", "failure", "not_contradicted", "sampler", "quantity")
        rows = pd.concat([read_csv(self.path(key), texts) for key in keys], ignore_index=True)
        rows = rows.reindex(columns=list(dict.fromkeys([*rows.columns, *texts])))
        return rows.assign(**{name: rows[name].fillna("") for name in texts})


def made_of(asked: Answerer, configured: ChangeSettings) -> dict[str, Any]:
    """Return all that answers depend on beside shares, variant and number."""
    return {
        "answers": asked.settings.to_plain(),
        "changes": configured.to_plain(),
        "variants": {name: asdict(variant) for name, variant in VARIANTS.items()},
        "spreads": asdict(SPREADS),
        "network": hashlib.sha256(asked.finished.estimator.read_bytes()).hexdigest(),
        "code": {name: stage_code(name) for name in CODE},
    }


def answer_missing(asked: Answerer, store: Store, keys: Sequence[Key], cores: int) -> None:
    """Answer the pairs that are not there yet, a person at a time."""
    missing = [key for key in keys if not store.has(key, asked.verdicts)]
    by_person: dict[int, list[Key]] = {}
    for key in missing:
        by_person.setdefault(key[2], []).append(key)
    progress = Progress("pairs", len(missing), unit="pair")
    for (number, its_keys), found in side_by_side(
        partial(answer_person, asked, store), list(by_person.items()), cores
    ):
        if isinstance(found, WorkerKilledError):
            sys.exit(f"person {number}: {found}; type the same again with fewer --cores: pairs are kept")
        progress.step(len(its_keys))


def answer_person(asked: Answerer, store: Store, person: tuple[int, Sequence[Key]]) -> None:
    """Answer pairs of one person, and keep each as soon as it is there; say nothing but warnings."""
    logging.getLogger("swesbi").setLevel(logging.WARNING)
    for key, rows in asked.person(*person):
        store.write(key, rows)


def tables(rows: pd.DataFrame, settings: ChangeSettings) -> dict[str, pd.DataFrame]:
    """Return the tables by what their file's name ends in."""
    pairs = one_row_a_pair(rows)
    return {
        "": rates(rows, settings.rule),
        "_flags": flags(pairs, settings.rule.one_person_level),
        "_costs": costs(rows),
    }


def main() -> None:
    """Answer the pairs that are asked for, print what they come to, and write it."""
    options = _options()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    study = load_study(
        read_merged(options.config, options.overlay), in_words(options.config, options.overlay)
    )
    configured, asked = study.config.changes, answerer(study, options)
    store = Store(
        asked.finished.estimator.parent / "change_pairs" / options.stream, made_of(asked, configured)
    )
    keys = [
        (shares, name, number)
        for number in range(options.pairs)
        for name in options.variants
        for shares in asked.changes
    ]
    answer_missing(asked, store, keys, options.cores)
    rows = store.read(keys)
    for row in rows[rows["failure"] != ""].to_dict("records"):
        print(f"no answer: {row['shares']}, {row['variant']}, pair {row['number'] + 1}: {row['failure']}")
    for ending, table in tables(rows, configured).items():
        print(table.to_string(index=False, float_format="%.3g"), end="\n\n")
        if options.out:
            write_csv(options.out.with_stem(f"{options.out.stem}{ending}"), table)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=200, help="persons of each variant; default: 200")
    parser.add_argument(
        "--variants", nargs="+", choices=VARIANTS, default=list(VARIANTS), help="default: all"
    )
    parser.add_argument("--cores", type=int, default=2, help="persons side by side; changes no number")
    parser.add_argument("--results", type=Path, help="folder of the finished study; default: as configured")
    parser.add_argument("--stream", choices=STREAMS, default="fresh", help="whose pairs; default: fresh")
    parser.add_argument("--shares", nargs="+", default=[], metavar="A,B", help="in place of changes.shares")
    parser.add_argument("--verdicts", action="store_true", help="judge each recording")
    parser.add_argument("--out", type=Path, help="main table to write")
    add_options(parser)
    options = at_configuration(parser.parse_args())
    if options.shares and options.stream != DEVELOPMENT:
        parser.error("--shares: they are chosen on pairs of development alone; add --stream development")
    if options.pairs < 1:
        parser.error(f"--pairs {options.pairs}: at least one is needed")
    return options


if __name__ == "__main__":
    main()

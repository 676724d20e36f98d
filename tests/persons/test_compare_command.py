from __future__ import annotations

import re
import shutil
import signal
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import free_case
import numpy as np
import pandas as pd
import pytest
from figure_text import assert_text_apart
from matplotlib.text import Text
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.answers.change import JOINT, TABLE, PersonChangeSettings, check_protocols
from swesbi.artefacts import Provenance
from swesbi.artefacts.csv import read_csv, write_csv
from swesbi.base.terminal import InterruptedBySignal
from swesbi.checks.scores import Band
from swesbi.config.read import ConfigError, read_merged
from swesbi.config.study import Study, load_study
from swesbi.persons.change.stored import (
    QUANTITIES,
    OnePerson,
    Ratios,
    StoredChange,
    change_lines,
    change_table,
)
from swesbi.report.figures.change import ShownVisit, draw_change
from swesbi.study import compare as command
from swesbi.study.answerer import Answerer
from swesbi.study.compare import pairs_of, visit_pair
from swesbi.study.results import OtherNetworkError, experiment_files, population_files

TRIAL = ROOT / "data" / "virtual_trial"
VOLUNTEERS = ROOT / "data" / "virtual_volunteers"
OTHER_MODEL = "forward_model: {maximum_step_s: 2.6e-3}"  # than that of what comes with the package


@pytest.fixture(scope="module")
def trial() -> Study:
    raw = read_merged(ROOT / "config.yaml") | {"cohort": str(VOLUNTEERS)}
    return load_study(raw, new_cohort=TRIAL)


@pytest.fixture
def cohort(tmp_path: Path) -> Path:
    """A copy of the trial to edit."""
    return Path(shutil.copytree(TRIAL, tmp_path / "trial"))


def subjects(cohort: Path) -> pd.DataFrame:
    return pd.read_csv(cohort / "subjects.csv", dtype=str)


def keep(table: pd.DataFrame, cohort: Path) -> None:
    table.to_csv(cohort / "subjects.csv", index=False)


def test_the_network_of_the_package_compares_where_no_study_has_been_run(tmp_path: Path) -> None:
    raw = read_merged(ROOT / "config.yaml") | {"results": str(tmp_path)}
    study = load_study(raw, new_cohort=TRIAL)
    assert command.experiment_with_network(study, None) == "amortised"
    assert command.experiment_with_network(study, "calibrated") == "calibrated"
    for path in experiment_files(study, "calibrated").files:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    assert command.experiment_with_network(study, None) == "calibrated"


def test_the_first_and_the_last_visit_are_compared_unless_others_are_named(
    trial: Study, cohort: Path
) -> None:
    pair = visit_pair(trial, "P01")
    assert (pair.visits, pair.subjects) == (("before", "after"), ("P01-before", "P01-after"))
    assert visit_pair(trial, "P01", "after", "before").subjects == ("P01-after", "P01-before")
    with pytest.raises(ConfigError, match="visit = 'never': person 'P01' has before, after"):
        visit_pair(trial, "P01", "never")
    with pytest.raises(ConfigError, match="visit = 'after': given as both visits of 'P01'"):
        visit_pair(trial, "P01", "after")
    table = subjects(cohort)
    keep(table[table["subject"] != "P02-after"], cohort)
    with pytest.raises(ConfigError, match="has one visit in .*, 'before', and a change needs two"):
        visit_pair(load_study(trial.config.to_plain(), new_cohort=cohort), "P02")


@pytest.fixture
def typed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """Run the command on the virtual trial, refused in part at least, and return what it says."""
    overlay = tmp_path / "overlay.yaml"
    overlay.write_text(f"results: {tmp_path / 'results'}\n{OTHER_MODEL}\n", encoding="utf-8")

    def run(*arguments: str, cohort: Path = TRIAL, code: int = 2) -> str:
        monkeypatch.chdir(ROOT)
        chosen = ("--cohort", str(cohort), "--experiment", "amortised", *arguments)
        assert main(["compare", "--overlay", str(overlay), *chosen]) == code
        return "".join(capsys.readouterr())

    return run


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("--person Nobody", "person = 'Nobody'"),
        ("--person P01 --from never", "visit = 'never'"),
        ("--person P01", "has not been run this far"),
        ("--person P01 --reference control", "names a group, which --all compares"),
        ("--all", "has not been run this far"),
        ("--all --from before", "name visits of one person; leave them out"),
        (f"--all --cohort {VOLUNTEERS}", "no person has two visits; its subjects.csv needs"),
        ("--all --reference placebo", "no person is of it; the groups are treated, control"),
    ],
)
def test_mistakes_are_told_before_anything_runs(
    typed: Callable[..., str], tmp_path: Path, arguments: str, words: str
) -> None:
    assert words in typed(*arguments.split())
    assert not (tmp_path / "results").exists()


def test_what_is_wrong_with_a_person_s_visit_stops_that_person_alone(
    typed: Callable[..., str], cohort: Path
) -> None:
    """A recording that is not there and a heart that cannot be, of two persons: a third is answered."""
    (cohort / "swe" / "P01-before.csv").unlink()
    table = subjects(cohort)
    table.loc[table["subject"] == "P03-after", "ivsd_cm"] = "9.5"
    keep(table, cohort)
    assert "there is no file P01-before.csv" in typed("--person", "P01", cohort=cohort)
    assert "column 'ivsd_cm': '9.5'" in typed("--person", "P03", cohort=cohort)
    assert "has not been run this far" in typed("--person", "P02", cohort=cohort)
    table.loc[table["subject"] == "P03-after", ["person", "visit", "group"]] = ""  # whose it is, nobody knows
    keep(table, cohort)
    for asked in (("--person", "P02"), ("--all",)):
        assert "column 'ivsd_cm': '9.5'" in typed(*asked, cohort=cohort)


def _touched(folder: Path) -> tuple[None, None]:
    folder.mkdir(parents=True)
    (folder / "observation.h5").touch()
    return None, None


class Instead:
    """In place of answers and stages: files of made-up numbers, and what the stage of groups was given."""

    def __init__(self) -> None:
        self.raised: dict[str, BaseException] = {}
        self.changes: list[str] = []
        self.observations: list[Path] = []
        self.left_out: list[str] = []
        self.failing = False

    def request(self, subject: str) -> SimpleNamespace:
        if subject in self.raised:
            raise self.raised[subject]
        return SimpleNamespace(answer_into=_touched, knowledge=None)

    def save_change(
        self, _: object, __: object, settings: PersonChangeSettings, made: Provenance, folder: Path
    ) -> StoredChange:
        change = replace(stored(), person=settings.person)
        change.write(folder / JOINT, Provenance("", made.subject))
        write_csv(folder / TABLE, change_table(change))
        return change

    def change_in_groups(
        self, changes: Sequence[StoredChange], observations: Sequence[Path], *, left_out: tuple[str, ...]
    ) -> None:
        self.changes, self.observations = [change.person for change in changes], [*observations]
        self.left_out = [*left_out]

    def save_groups(self, _: None, folder: Path, *__: object) -> None:
        for name in command.GROUP_OUTPUTS:
            (folder / name).touch()
        if self.failing:
            raise ValueError("their draws lie nowhere")


@pytest.fixture
def instead(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Instead:
    """Nothing is inferred; the study's own network and null recordings are empty files."""
    null = tmp_path / "results" / "amortised" / "null.h5"
    null.parent.mkdir(parents=True)
    for path in (*population_files(tmp_path / "results", "amortised", null).files, null):
        path.touch()
    made = Instead()
    monkeypatch.setattr(Answerer, "request", lambda _, subject: made.request(subject))
    monkeypatch.setattr(command, "save_change", made.save_change)
    monkeypatch.setattr(command, "change_in_groups", made.change_in_groups)
    monkeypatch.setattr(command, "save_groups", made.save_groups)
    monkeypatch.setattr(command.Observation, "read", lambda path: path)
    return made


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_refused_visit_is_named_and_nothing_is_written(
    typed: Callable[..., str], instead: Instead, tmp_path: Path
) -> None:
    instead.raised = {"P01-after": ValueError("hr_bpm = 250 lies outside 40 to 130")}
    made = sorted(tmp_path.rglob("*"))
    said = typed("--person", "P01", "--out", str(tmp_path / "out"))
    assert "visit 'after' of 'P01' (recording P01-after): hr_bpm = 250 lies outside 40 to 130" in said
    assert sorted(tmp_path.rglob("*")) == made


def test_all_who_came_twice_are_compared_and_the_others_named(
    typed: Callable[..., str], instead: Instead, cohort: Path, tmp_path: Path
) -> None:
    out, table = tmp_path / "out", subjects(cohort)
    table.loc[table["person"] == "P02", "ivsd_cm"] = "2.2"  # a heart that the network does not know
    keep(table[table["subject"] != "P05-after"], cohort)
    (cohort / "swe" / "P03-before.csv").unlink()
    instead.raised = {"P04-after": ValueError("its recording\nis too short")}
    shown = typed("--all", "--out", str(out), cohort=cohort)
    assert "20 compared, 3 refused" in shown
    assert "refused: P02: visit 'before' (recording P02-before) is refused, ivsd_cm = 2.2" in shown
    persons = [f"P{number:02d}" for number in (1, *range(6, 25))]
    assert names_in(out) == {*persons, command.ALL_CHANGES, *command.GROUP_OUTPUTS}
    changes = pd.read_csv(out / command.ALL_CHANGES)
    assert list(changes) == ["experiment", *change_table(stored())]
    assert set(changes["experiment"]) == {"amortised"}
    assert list(changes["person"].unique()) == instead.changes == persons
    first = [out / person / f"{person}-before" / "observation.h5" for person in persons]
    assert instead.observations == first
    said = "\n".join(instead.left_out)
    assert "left out with one visit, since a change needs two: P03, P05" in said
    assert said.count("P02 is left out: visit 'before' (recording P02-before) is refused, ivsd_cm = 2.2") == 1
    assert "P03 is left out: " in said and "there is no file P03-before.csv" in said
    assert "P04 is left out: visit 'after' of 'P04' (recording P04-after): its recording is too short" in said


def test_a_person_whose_name_or_folder_is_wrong_is_refused_alone(
    typed: Callable[..., str], instead: Instead, cohort: Path, tmp_path: Path
) -> None:
    """Names that pandas takes for missing cells or numbers are names; nobody is in their way."""
    out, table = tmp_path / "out", subjects(cohort)
    names = {"P01": "NA", "P02": "007", "P03": "2024/001", "P05": "nan"}
    keep(table[table["person"] <= "P05"].replace({"person": names}), cohort)
    out.mkdir()
    (out / "P04").touch()
    shown = typed("--all", "--out", str(out), cohort=cohort)
    assert "3 compared, 2 refused" in shown
    assert re.search(r"refused: 2024/001: (.|\n)*column 'person': '2024/001' has a sign that", shown)
    assert re.search(r"refused: P04: .*/out/P04: is a file", shown)
    assert list(read_csv(out / command.ALL_CHANGES)["person"].unique()) == ["NA", "007", "nan"]


def test_groups_that_fail_lose_no_person(
    typed: Callable[..., str], instead: Instead, cohort: Path, tmp_path: Path
) -> None:
    out, instead.failing, table = tmp_path / "out", True, subjects(cohort)
    keep(table[table["person"] <= "P03"], cohort)
    out.mkdir()
    (out / command.GROUP_OUTPUTS[1]).write_text("of an earlier run")
    shown = typed("--all", "--out", str(out), cohort=cohort)
    assert "3 compared, 0 refused" in shown
    assert shown.endswith("no change in groups: their draws lie nowhere\n")
    assert names_in(out) == {"P01", "P02", "P03", command.ALL_CHANGES}


def test_what_is_wrong_with_the_network_or_nobody_compared_writes_no_table(
    typed: Callable[..., str], instead: Instead, trial: Study, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    instead.raised = {"P02-before": OtherNetworkError("was trained with another prior")}
    assert "swesbi: was trained with another prior" in typed("--all", "--out", str(out))
    assert names_in(out) == {"P01"}  # who was compared before stays
    shutil.rmtree(out)
    instead.raised = {pair.subjects[0]: ValueError("is too short") for pair in pairs_of(trial)}
    shown = typed("--all", "--out", str(out))
    assert "no person can be compared\nrefused: P01: visit 'before' of 'P01'" in shown
    assert not out.exists()


def test_stopped_among_all_it_leaves_those_who_were_compared(
    typed: Callable[..., str], instead: Instead, tmp_path: Path
) -> None:
    instead.raised = {"P03-after": InterruptedBySignal(signal.SIGINT)}
    typed("--all", "--out", str(tmp_path / "out"), code=130)
    assert names_in(tmp_path / "out") == {"P01", "P02"}
    assert names_in(tmp_path) == {"overlay.yaml", "out", "results"}


def test_visits_of_different_protocols_are_refused(tmp_path: Path) -> None:
    """Only the numbers of phases are looked at, and whether there are any."""
    visits: list[Any] = [SimpleNamespace(phase=np.arange(number), is_gated=True) for number in (20, 12)]
    check_protocols(visits[:1] * 2, ("before", "after"))
    with pytest.raises(ValueError, match="gated phases by visit: 'before' 20, 'after' 12; .* same protocol"):
        check_protocols(visits, ("before", "after"))
    free_case.train(2).to_csv(tmp_path / "T.csv", index=False)
    pushes = free_case.observed(tmp_path / "T.csv")
    with pytest.raises(ValueError, match="T is free-running: .* so both must be gated"):
        check_protocols([visits[0], pushes], ("before", "after"))


def stored(p_value: float = 0.5, changed: float = 0.99) -> StoredChange:
    """A change of made-up numbers."""
    rng = np.random.default_rng(1)
    ratios = np.outer([1.2, 1.1, 1.3, 0.99, changed, 0.0, 0.05, 0.3, 0.4], np.ones(4))
    return StoredChange(
        visit=("before", "after"), quantity=QUANTITIES, parameter=("a", "b"), share=("speed_scale",),
        person="P", subject=np.array(["P1", "P2"]), verdict=np.array(["not contradicted", "doubtful"]),
        phi=rng.random((2, 50, 2)), quantities=1.0 + rng.random((2, 50, 4)), shares=np.array([0.8]),
        ratios=Ratios(*ratios), one_person=OnePerson(2.0, 1.0, p_value, 0.05, 0.7), sampler="importance",
        converged=True, reasons="", k_hat=0.3, k_hat_limit=0.7, efficiency=0.1, weighted_draws=1000,
        log_evidence=50.0, log_evidence_se=0.1, interval_mass=0.9, threshold=0.1, probability=0.95,
    )  # fmt: skip


def test_names_with_dollar_signs_are_drawn_as_they_are() -> None:
    at = np.arange(3.0) / 3.0
    observed: Any = SimpleNamespace(
        phase=at, measured=at > 0.0, stiffness_kpa=at, stiffness_se_kpa=at, samples_accepted=at,
        samples_rejected=at, context=SimpleNamespace(hr_bpm=60.0),
    )  # fmt: skip
    verdict: Any = SimpleNamespace(reasons=())
    visit = ShownVisit(observed, verdict, at, Band(at, at, at))
    named = replace(stored(), person=r"$\person$", visit=(r"_$\first$", r"$\second$"))
    for page in (False, True):
        figure = draw_change(named, [visit, visit], r"$\title$", page=page)
        assert_text_apart(figure)
        shown = [text.get_text() for text in figure.findobj(Text)]
        assert any(text.startswith(r" _\$\first\$: median") for text in shown)


CHANGED = "changed by more than 10% in one direction with probability above 0.95: active stiffness scale k_0"


@pytest.mark.parametrize(
    ("p_value", "changed", "one_person", "words"),
    [
        (0.5, 0.99, "can be of one person", CHANGED),
        (0.01, 0.2, "NOT of one person", "nothing has changed by more than 10%"),
    ],
)
def test_table_and_answer_say_what_was_decided(
    p_value: float, changed: float, one_person: str, words: str
) -> None:
    change = stored(p_value, changed)
    table, said = change_table(change), "\n".join(change_lines(change))
    assert list(table["quantity"]) == list(QUANTITIES)
    assert set(table["changed"]) == {changed > 0.95}
    assert set(table["one_person"]) == {p_value > 0.05}
    assert one_person in said and words in said
    assert "after (P2): doubtful by itself" in said
    assert "scale of all speeds 0.8" in said


def test_the_change_in_groups_has_groups_and_who_is_left_out(trial: Study) -> None:
    parts = command.groups_settings(trial, "amortised", {"P01": "is too\nshort"}, "control")
    assert Counter(parts["groups"].values()) == {"control": 12, "treated": 12}
    assert parts["left_out"] == ["P01 is left out: is too short"]
    assert parts["cohort_posterior"]["reference_group"] == "control"


def test_a_reference_group_of_the_configuration_is_one_that_is_there(trial: Study) -> None:
    plain = trial.config.to_plain() | {"cohort": str(TRIAL)}
    plain["cohort_posterior"]["reference_group"] = "placebo"
    with pytest.raises(ConfigError, match="cohort_posterior.reference_group: reference group 'placebo'"):
        load_study(plain)


def test_true_ratios_are_those_of_a_generated_cohort_alone(trial: Study, tmp_path: Path) -> None:
    pairs = pairs_of(trial)
    found = command.true_ratios(TRIAL, pairs)
    assert found is not None
    table = read_csv(TRIAL / "truth.csv").set_index("subject")
    assert found[2, 1] == table["k_atp_per_s"]["P03-after"] / table["k_atp_per_s"]["P03-before"]
    assert command.true_ratios(tmp_path, pairs) is None
    (tmp_path / "truth.csv").write_text("subject,what\nP01-before,7\n", encoding="utf-8")
    assert command.true_ratios(tmp_path, pairs) is None

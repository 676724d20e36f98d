from __future__ import annotations

from pathlib import Path

import pytest
from study_copy import ROOT
from test_compare_command import OTHER_MODEL

from swesbi.__main__ import main
from swesbi.persons.planning.effect import Effect, parse_effect, parse_percent, parse_repeats


def test_effects_are_read_by_short_names_and_whole_ones() -> None:
    assert parse_effect("k_sr=-20%") == Effect("k_sr_per_s", -0.2)
    assert parse_effect("k0=0.1") == Effect("k0_kpa", 0.1)
    assert parse_effect("K_ATP = +15 %") == Effect("k_atp_per_s", 0.15)
    assert parse_effect("k0_kpa=5%").words == "k_0 +5 %"
    assert parse_percent("3%", "--noise") == 0.03


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("k_sr", "expected a parameter and its change"),
        ("kappa=-20%", "'kappa' is no parameter; those are k0, k_atp, k_sr"),
        ("k_sr=-100%", "a fall by 100% leaves nothing"),
        ("k_sr=a fifth", "expected a percentage such as 20%"),
    ],
)
def test_what_is_no_effect_is_refused(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        parse_effect(text)


def test_repeats_are_numbers_of_which_errors_can_be_told() -> None:
    assert parse_repeats("3,5,5,8", 2) == (3, 5, 8)
    for text, words in (("1,3", "'1,3': 1 cannot be answered"), ("three", "expected a number of repeats")):
        with pytest.raises(ValueError, match=words):
            parse_repeats(text, 2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("k_sr=0", "a change of 0 is no effect"),
        ("k_sr=+150%", "from 30 to 75, outside the prior's bounds 2 to 60"),
        ("k_sr=-20% --repeats 1", "1 cannot be answered"),
        ("k_sr=-20% --noise 60%", "the network has learnt from 0.9% to 6.0%"),
        ("k_sr=-20% --power 100%", "--power '100%'"),
        ("k_sr=-20% --persons 1000", "--persons 1000: outside 4 to 100"),
        ("k_sr=-20% --experiment calibrated", "need a network of a population: amortised"),
        ("k_sr=-20%", "has not been run this far"),
    ],
)
def test_mistakes_are_told_before_anything_runs(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: str,
    words: str,
) -> None:
    overlay = tmp_path / "overlay.yaml"
    overlay.write_text(f"results: {tmp_path / 'results'}\n{OTHER_MODEL}\n", encoding="utf-8")
    monkeypatch.chdir(ROOT)
    assert main(["plan", "--overlay", str(overlay), "--effect", *arguments.split()]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "results").exists()

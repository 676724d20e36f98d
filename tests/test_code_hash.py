from collections.abc import Iterator
from pathlib import Path

import pytest

from swesbi import code_hash
from swesbi.code_hash import imported_modules, stage_hash


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A small package of the same name: stages.one imports science, stages.two does not."""
    for folder in ("", "stages", "part"):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "__init__.py").write_text("")
    (tmp_path / "part" / "__init__.py").write_text("from swesbi.part.science import law\n")
    (tmp_path / "part" / "science.py").write_text('def law(x):\n    """Doc."""\n    return 2 * x\n')
    (tmp_path / "stages" / "one.py").write_text("from swesbi.part import law\nprint(law(1))\n")
    (tmp_path / "stages" / "two.py").write_text("import json\nprint(json)\n")
    monkeypatch.setattr(code_hash, "SOURCE", tmp_path)
    clear()
    yield tmp_path
    clear()


def clear() -> None:
    code_hash._imports.cache_clear()
    code_hash._meaning.cache_clear()
    code_hash._texts.cache_clear()


def edit(path: Path, old: str, new: str) -> None:
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    clear()


def test_imports_are_followed_through_a_package(package: Path) -> None:
    assert imported_modules("swesbi.stages.one") == {
        "swesbi.stages.one",
        "swesbi.part",
        "swesbi.part.science",
    }


def test_code_counts_for_the_stages_that_use_it(package: Path) -> None:
    one, two = stage_hash("swesbi.stages.one"), stage_hash("swesbi.stages.two")
    edit(package / "part" / "science.py", "2 * x", "3 * x")
    assert stage_hash("swesbi.stages.one") != one
    assert stage_hash("swesbi.stages.two") == two


def test_docstrings_comments_and_layout_do_not_count(package: Path) -> None:
    before = stage_hash("swesbi.stages.one")
    edit(package / "part" / "science.py", '"""Doc."""', '"""Another text."""  # and a comment\n')
    assert stage_hash("swesbi.stages.one") == before


def test_an_unknown_module_is_refused(package: Path) -> None:
    with pytest.raises(ModuleNotFoundError, match="no module"):
        stage_hash("swesbi.stages.three")


def test_simulators_and_plotters_do_not_import_the_network() -> None:
    for stage in ("cohort", "simulation", "predictive", "cmaes", "subject_figures", "tables"):
        assert not any(
            name.startswith("swesbi.inference.train") for name in imported_modules(f"swesbi.stages.{stage}")
        )


def test_a_data_file_counts_for_the_modules_that_name_it(package: Path) -> None:
    (package / "part" / "texts").mkdir()
    (package / "part" / "texts" / "page.html").write_text("<p>one</p>")
    edit(
        package / "part" / "science.py",
        "2 * x",
        '2 * x, "texts/page.html", "texts/absent.html", "science.py"',
    )
    one, two = stage_hash("swesbi.stages.one"), stage_hash("swesbi.stages.two")
    edit(package / "part" / "texts" / "page.html", "one", "two")
    assert stage_hash("swesbi.stages.one") != one
    assert stage_hash("swesbi.stages.two") == two

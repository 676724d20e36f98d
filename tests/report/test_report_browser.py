"""Both reports of a finished study in a browser: no error, every image, every link, legible to all."""

from __future__ import annotations

import base64
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from browser import Browser, browser, find_browser, in_dark, serious
from study_copy import StudyCopy, duplicate

from swesbi.report.page.names import FURTHER

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("program")]

DESKTOP_PX, PHONE_PX = 1280, 390
PAGES = ("index.html", *(f"report/{name}.html" for name in FURTHER))
MOST_WORDS, MOST_SCREENS = 900, 5.0
LONGER = {"report/paper.html": 8.0, "report/checks.html": 11.0}  # their figures are open
WORDS = "document.body.innerText.split(/\\s+/).filter(Boolean).length"
SCREENS = "document.documentElement.scrollHeight / innerHeight"
FIRST_HEADING = "document.querySelector('figure.table thead th.number button')"
COLUMN = "[...document.querySelectorAll('tbody tr')].map(row => parseFloat(row.cells[2].textContent))"
IMAGES = """Promise.all([...document.images].map(async image => {
    await image.decode().catch(() => {});
    return [image.currentSrc || image.src, image.naturalWidth, image.alt];
}))"""
LINKS = "[...document.querySelectorAll('a[href]')].map(link => link.href)"
TARGETS = "[...document.querySelectorAll('[id]')].map(element => element.id)"
TOO_WIDE = """(() => {
    const width = document.documentElement.clientWidth;
    const contained = element => element.closest('.scroll, pre') !== null && !element.matches('.scroll, pre');
    return [...document.body.querySelectorAll('*')]
        .filter(element => !contained(element) && element.getBoundingClientRect().right > width + 1)
        .map(element => element.outerHTML.slice(0, 80));
})()"""
SCROLLS = "document.documentElement.scrollWidth > document.documentElement.clientWidth"
CATEGORIES = (
    "Object.fromEntries(Object.entries(categories).map(([name, parts]) => [name, Object.keys(parts)]))"
)
SHOW_IMAGE = "app.setView({content: 'img', contentPath: results[PATH].data_uri, resultPath: PATH})"
SHOWN_IMAGE = """(async () => {
    const image = [...document.images].find(image => image.src === results[PATH].data_uri);
    if (!image) return 0;
    await image.decode();
    return image.naturalWidth;
})()"""


@pytest.fixture(scope="module")
def program() -> str:
    """The browser's program; without one tests are skipped before any study is run, and fail in CI."""
    return find_browser()


@pytest.fixture(scope="module")
def page(program: str) -> Iterator[Browser]:
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def results(program: str, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a finished study, copied away from the project, with both reports among them."""
    # asked for here, since pytest would otherwise run the study before it looks for the browser
    finished: StudyCopy = request.getfixturevalue("finished")
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    study = duplicate(finished, elsewhere / "study")
    study.run("--report", "snakemake-report.html")
    copy = elsewhere / "results of a study"
    shutil.move(study.results, copy)
    shutil.move(study.folder / "snakemake-report.html", copy / "snakemake-report.html")
    return copy


def assert_no_trouble(page: Browser) -> None:
    """The page has raised no error, and has asked for nothing but local files."""
    assert page.complaints == []
    assert {urlsplit(address).scheme for address in page.requests} <= {"file", "data", "blob"}


# what a population's network learnt from, and how it is calibrated, is not of the cohort
NOT_OF_VOLUNTEERS = ("strata-amortised.png", "training-amortised.png")


@pytest.mark.parametrize("width_px", [DESKTOP_PX, PHONE_PX])
@pytest.mark.parametrize("name", PAGES)
def test_every_page_shows_all_its_images_within_the_window(
    page: Browser, results: Path, name: str, width_px: int
) -> None:
    page.open(results / name, width_px)
    assert not page.evaluate(SCROLLS)
    page.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
    images = page.evaluate(IMAGES)
    assert [source for source, width, _ in images if not width] == []
    of_volunteers = [image for image in images if not image[0].endswith(NOT_OF_VOLUNTEERS)]
    assert [source for source, _, alt in of_volunteers if "virtual volunteers" not in alt] == []
    assert page.evaluate("innerWidth") == width_px
    assert not page.evaluate(SCROLLS)
    assert page.evaluate(TOO_WIDE) == []
    assert_no_trouble(page)


def test_the_pages_are_short_enough_to_be_read(page: Browser, results: Path) -> None:
    page.open(results / "index.html", 1400)
    assert page.evaluate(WORDS) <= MOST_WORDS
    for name in PAGES:
        page.open(results / name, 1400)
        assert page.evaluate(SCREENS) <= LONGER.get(name, MOST_SCREENS), name


def test_a_table_is_sorted_from_the_keyboard(page: Browser, results: Path) -> None:
    page.open(results / "index.html", DESKTOP_PX)
    page.evaluate(f"{FIRST_HEADING}.focus()")
    for direction in ("ascending", "descending"):
        for kind in ("keyDown", "keyUp"):
            page.call("Input.dispatchKeyEvent", type=kind, key="Enter", code="Enter", text="\r")
        assert page.evaluate(f"{FIRST_HEADING}.parentElement.getAttribute('aria-sort')") == direction
        shown = page.evaluate(COLUMN)
        assert len(shown) > 2
        assert shown == sorted(shown, reverse=direction == "descending")


@pytest.mark.parametrize("name", PAGES)
def test_a_page_can_be_printed(page: Browser, results: Path, name: str) -> None:
    page.open(results / name, DESKTOP_PX)
    assert base64.b64decode(page.call("Page.printToPDF")["data"]).startswith(b"%PDF-")
    assert not page.evaluate("document.querySelector('details[open]') !== null")
    assert_no_trouble(page)


def test_every_link_of_the_pages_leads_somewhere(page: Browser, results: Path) -> None:
    root, links = results.resolve(), set()
    targets: dict[Path, set[str]] = {}
    for name in PAGES:
        page.open(results / name, DESKTOP_PX)
        targets[root / name] = set(page.evaluate(TARGETS))
        links |= set(page.evaluate(LINKS))
    linked = set()
    for link in links:
        parts = urlsplit(link)
        path = Path(unquote(parts.path))
        assert parts.scheme == "file", link
        assert path.is_relative_to(root), link
        assert path.is_file(), link
        assert not parts.fragment or parts.fragment in targets[path], link
        linked.add(path)
    kept = {path for path in root.rglob("*") if path.is_file() and path.name != "snakemake-report.html"}
    kept -= {path for path in kept if path.relative_to(root).parts[0] == "logs"}
    assert kept - linked == set()


def test_snakemakes_report_shows_every_category_and_figure_without_error(
    page: Browser, results: Path
) -> None:
    page.open(results / "snakemake-report.html", DESKTOP_PX)
    categories = page.evaluate(CATEGORIES)
    assert {"Cohort", "Tables", "Configuration", "Experiment paper"} <= categories.keys()
    assert {"Subject A", "Subject F"} <= set(categories["Experiment paper"])
    for category in categories:
        page.evaluate(f"app.showCategory({category!r})")
        page.settle()
        assert category in page.evaluate("document.body.innerText")
    assert page.evaluate("rules['subject_figures'] !== undefined")
    figures = page.evaluate(
        "Object.keys(results).filter(path => results[path].mime_type.startsWith('image/'))"
    )
    assert len(figures) >= 5 + 1 + 2 * 2
    for path in figures:
        assert page.evaluate(f"results[{path!r}].caption.length > 40"), path
        page.evaluate(SHOW_IMAGE.replace("PATH", repr(path)))
        page.settle()
        assert page.evaluate(SHOWN_IMAGE.replace("PATH", repr(path))) > 0, path
    assert all(link.startswith(("file:", "data:")) for link in page.evaluate(LINKS))
    assert_no_trouble(page)


# further pages have the colours of the landing page, and the largest takes a while
@pytest.mark.parametrize(
    ("name", "width_px", "dark"),
    [
        *((name, DESKTOP_PX, False) for name in PAGES),
        *(("index.html", *way) for way in ((DESKTOP_PX, True), (PHONE_PX, False), (PHONE_PX, True))),
    ],
)
def test_nothing_keeps_a_reader_from_reading(
    page: Browser, results: Path, name: str, width_px: int, dark: bool
) -> None:
    in_dark(page, dark=dark)
    page.open(results / name, width_px)
    found = serious(page)
    assert not found, json.dumps(found, indent=1)


def test_a_page_that_is_worse_is_found_out(page: Browser, results: Path) -> None:
    """Without its language, with pale text and a picture without words."""
    in_dark(page, dark=False)
    page.open(results / "index.html", DESKTOP_PX)
    page.evaluate("document.documentElement.removeAttribute('lang')")
    page.evaluate("document.querySelector('p').style.color = '#ddd'")
    page.evaluate("document.body.append(new Image())")
    assert {rule for _, rule, _ in serious(page)} >= {"html-has-lang", "color-contrast", "image-alt"}

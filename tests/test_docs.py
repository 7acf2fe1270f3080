"""The documentation builds from the checkout, without network access and warnings, and agrees with the code."""

import html
import importlib.util
import json
import os
import re
import subprocess
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest

from r2c2r_core.config import ReconstructConfig
from r2c2r_core.export.simulators import recipes
from r2c2r_core.tuning import modules_with_numbers, params_of

ROOT = Path(__file__).resolve().parent.parent
without_mkdocs = pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="pip install --group dev")
SHOWN = re.compile(r'^ *--8<-- "([^":]+)(?::(\w+))?"$', re.MULTILINE)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site as `make docs` builds it, without network access."""
    out = tmp_path_factory.mktemp("site")
    unreachable = {"http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(out)],
        cwd=ROOT,
        env={**os.environ, **unreachable, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stderr.strip() == ""
    return out


def settings_of(config: object, path: str = "") -> list[tuple[str, str]]:
    """(section, setting) of every setting."""
    found = []
    for field in fields(config):  # type: ignore[arg-type]
        value = getattr(config, field.name)
        if room := field.metadata.get("room"):
            modules = modules_with_numbers(room)
            found += [(f"{room}.params.{m.partition('.')[2]}", n.name) for m in modules for n in fields(params_of(m))]
        found += settings_of(value, f"{path}.{field.name}".strip(".")) if is_dataclass(value) else [(path, field.name)]
    return found


@pytest.mark.slow
@without_mkdocs
def test_every_setting_is_documented(site: Path) -> None:
    sections = re.split(r"<h3 id=\"[^\"]*\">", (site / "settings.html").read_text())
    by_name = {section.partition("<a ")[0]: section for section in sections[1:]}
    missing = [(s, name) for s, name in settings_of(ReconstructConfig()) if f"<code>{name}</code>" not in by_name[s]]
    assert missing == []


@pytest.mark.slow
@without_mkdocs
def test_every_page_is_linked_and_loads_nothing_from_other_hosts(site: Path) -> None:
    start = (site / "index.html").read_text()
    pages = [p for p in site.rglob("*.html") if p.name != "404.html"]
    assert len(pages) >= len(list((ROOT / "docs").rglob("*.md")))
    for page in pages:
        assert f'href="{page.relative_to(site)}"' in start, page
        loaded = re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=\"(https?://[^\"]+)\"", page.read_text())
        assert loaded == [], page


@pytest.mark.slow
@without_mkdocs
def test_included_files_appear_in_their_pages(site: Path) -> None:
    """A misspelt include marker is printed verbatim, without a warning."""
    for page in (ROOT / "docs").rglob("*.md"):
        built = re.sub(r"<[^>]*>", "", (site / page.relative_to(ROOT / "docs").with_suffix(".html")).read_text())
        assert re.search(r"8 *&lt; *-|8 *< *-", built) is None, f"{page} shows a marker instead of a file"
        for name in re.findall(r'^--8<-- "([^":]+\.py)"$', page.read_text(), re.MULTILINE):
            first = (ROOT / name).read_text().partition("\n")[0]
            assert html.unescape(built).count(first) == 1, f"{page} lacks {name}"
    assert "def main" in re.sub(r"<[^>]*>", "", (site / "how-to" / "python.html").read_text())


@pytest.mark.slow
@without_mkdocs
def test_every_simulator_and_tried_engine_is_documented(site: Path) -> None:
    page = html.unescape(re.sub(r"<[^>]*>", "", (site / "how-to" / "simulators.html").read_text()))
    assert [recipe.simulator for recipe in recipes("kitchen", "drawer_1") if recipe.code.splitlines()[0] not in page] == []
    rows = json.loads((ROOT / "benchmarks" / "engines.json").read_text()).values()
    assert {name for row in rows for name in row["loaders"]} - {line.strip() for line in page.splitlines()} == set()


@pytest.mark.slow
@without_mkdocs
def test_the_reference_contains_the_docstrings(site: Path) -> None:
    reference = (site / "reference.html").read_text()
    assert "Turn one RGB-D recording into an articulated scene" in reference
    assert "world_from_mesh = world_from_camera @ camera_from_mesh" in reference


def test_sections_included_by_pages_exist_in_their_files() -> None:
    shown = [found for page in (ROOT / "docs").rglob("*.md") for found in SHOWN.findall(page.read_text())]
    assert len(shown) > 5
    for name, section in shown:
        text = (ROOT / name).read_text()
        assert not section or text.count(f"[start:{section}]") == text.count(f"[end:{section}]") == 1, (name, section)

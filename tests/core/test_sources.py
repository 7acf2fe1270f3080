"""Digest of a package's source."""

from pathlib import Path

from r2c2r_core.sources import source_files


def test_source_files_include_page_assets_and_exclude_compiled_code(tmp_path: Path) -> None:
    package = tmp_path / ".venv" / "export"
    for name in ("stage.py", "review_page/page.js", "review_page/page.css", "__pycache__/stage.pyc", ".stage.py.swp"):
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    found = [str(path.relative_to(package)) for path in source_files(package)]
    assert found == ["review_page/page.css", "review_page/page.js", "stage.py"]

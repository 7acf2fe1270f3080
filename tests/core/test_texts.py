"""Control characters in foreign texts are escaped, in a terminal and on a page."""

import pytest

from r2c2r_core.cli import main
from r2c2r_core.export.manifest import manifest_of
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.report import report_html, report_of
from r2c2r_core.model.report import ALIKE, Certificate, LoaderResult
from r2c2r_core.terminal import certificate_text, table
from r2c2r_core.texts import OBEYED, fault_of, shown
from tests.core.export.kitchen import kitchen, reconstruction

EVIL = "\x1b]0;owned\x07\x9b31m\u202e\ud800"


def certificate() -> Certificate:
    loader = LoaderResult(loader="PyBullet", state="failed", detail=f"says {EVIL}")
    return Certificate(
        passed=True,
        likeness=ALIKE,
        findings=(),
        loaders=(loader,),
        joints=(),
        rest_penetration_m=0.0,
        drift_m=0.0,
        realtime_factor=1.0,
    )


def test_control_characters_are_escaped() -> None:
    assert shown("a\x1b[31m\tb\n") == "a\\u001b[31m\tb\n"
    assert shown("Küche 日本 مطبخ 🙂") == "Küche 日本 مطبخ 🙂"


def test_tables_and_certificates_contain_no_control_sequences() -> None:
    assert not OBEYED.search(table(("name",), [(EVIL,), ("two\nlines",)]))
    assert len(table(("name",), [("two\nlines",)]).splitlines()) == 3
    assert not OBEYED.search(certificate_text(certificate()))


def test_error_messages_contain_no_control_sequences(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", f"no{EVIL[:-1]}.zip"]) == 2
    assert not OBEYED.search(capsys.readouterr().err)


def test_the_report_contains_no_control_sequences() -> None:
    manifest = manifest_of(reconstruction(), plan_bundle(kitchen()), None)
    manifest["objects"][0] |= {"category": f"cabinet {EVIL}", "warnings": [EVIL]}
    page = report_html(manifest, report_of(manifest, certificate(), {"mug_1": EVIL}), {})
    assert not OBEYED.search(page)
    assert "cabinet \\u001b]0;owned" in page


def test_a_key_error_is_described_as_a_missing_key() -> None:
    assert fault_of(KeyError("position")) == "'position' is missing"
    assert fault_of(ValueError("not a number")) == "not a number"

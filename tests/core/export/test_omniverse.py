from typing import Any

from r2c2r_core.export.omniverse import FALSE_ALARMS, validated


def said(*issues: tuple[str, str]) -> dict[str, Any]:
    entries = [{"rule": rule, "severity": severity, "where": "/Scene/a", "message": "m"} for rule, severity in issues]
    return {"version": "validator 1", "issues": entries}


def test_a_serious_issue_fails_with_its_rule_and_location() -> None:
    result = validated("NVIDIA", said(("VG.016", "warning"), ("RB.001", "failure")))
    assert result.state == "failed"
    assert result.detail == "validator 1: 1 serious, first RB.001 at /Scene/a: m"


def test_known_false_alarms_pass_and_are_counted_with_the_reason() -> None:
    result = validated("NVIDIA", said(("RB.007", "failure"), ("RB.007", "failure")))
    assert result.state == "passed"
    assert result.detail == f"validator 1: 2 x RB.007 ({FALSE_ALARMS['RB.007']})"


def test_a_warning_of_another_rule_passes_and_is_shown() -> None:
    assert validated("NVIDIA", said(("ZZ.1", "warning"))).detail == "validator 1: 1 x ZZ.1 (a warning)"


def test_no_issues_are_reported_as_no_issues() -> None:
    assert validated("NVIDIA", said()).detail == "validator 1: no issues"

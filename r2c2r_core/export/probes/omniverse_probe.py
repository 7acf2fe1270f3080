"""Run NVIDIA's asset validator on scene.usda: `python omniverse_probe.py scene.usda answer.json`.

Runs in a separate environment (omniverse-asset-validator and usd-core), so it imports nothing from r2c2r.
"""

import json
import logging
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any


def issues_of(scene: Path) -> dict[str, Any]:
    """All issues of all rules: the rule's id, else its name; severity; location; message."""
    logging.disable(logging.INFO)
    from omni.asset_validator import ValidationEngine  # type: ignore[import-not-found]  # lives in an environment of its own

    found = ValidationEngine(init_rules=True).validate(str(scene)).issues()
    return {
        "version": f"omniverse-asset-validator {version('omniverse-asset-validator')}",
        "issues": [
            {
                "rule": issue.code or issue.rule.__name__,
                "severity": issue.severity.name.lower(),
                "where": str(getattr(issue.at, "path", "") or ""),
                "message": issue.message,
            }
            for issue in found
        ],
    }


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(issues_of(Path(sys.argv[1]))))

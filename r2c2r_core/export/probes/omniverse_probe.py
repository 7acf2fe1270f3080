"""What NVIDIA's asset validator says of scene.usda: `python omniverse_probe.py scene.usda answer.json`.

Runs in an environment of its own (omniverse-asset-validator and usd-core), so it imports nothing of r2c2r.
"""

import json
import logging
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any


def issues_of(scene: Path) -> dict[str, Any]:
    """Every issue of every rule: the rule's id where it has one, else its name; how serious; where; what."""
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

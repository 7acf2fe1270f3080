"""Everything CI runs: Python tests, JavaScript tests, browser tests. What cannot run here is reported as not run.

With R2C2R_REQUIRE_ALL set (CI), node and a Chromium are required instead.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
REQUIRED = bool(os.environ.get("R2C2R_REQUIRE_ALL"))


def main() -> int:
    """Run the suites; the exit code is the worst of them."""
    node = shutil.which("node")
    chromium = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
    not_run = [
        what for what, tool in (("JavaScript tests (no node)", node), ("browser tests (no Chromium)", chromium)) if not tool
    ]
    if REQUIRED and not_run:
        sys.stderr.write(f"required here but not possible: {', '.join(not_run)}\n")
        return 1
    codes = []
    if node:
        tests = sorted(str(path) for path in (ROOT / "tests" / "js").glob("*.test.js"))
        codes.append(subprocess.call([node, "--test", *tests], cwd=ROOT))
    selection = ["-m", "not browser"] if chromium is None else []
    workers = ["-n", "2", "--dist", "loadfile"]
    codes.append(subprocess.call([sys.executable, "-m", "pytest", *workers, *selection, *sys.argv[1:]], cwd=ROOT))
    for what in not_run:
        sys.stdout.write(f"NOT RUN: {what}\n")
    return max(codes)


if __name__ == "__main__":
    sys.exit(main())

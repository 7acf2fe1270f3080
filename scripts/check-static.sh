#!/usr/bin/env bash
# tsc and prettier over static/; without node they are reported as not run, unless R2C2R_REQUIRE_ALL asks for them.
set -euo pipefail
cd "$(dirname "$0")/../static"
if ! command -v npm >/dev/null 2>&1; then
    if [ -n "${R2C2R_REQUIRE_ALL:-}" ]; then
        echo "node is required here: apt-get install -y nodejs npm" >&2
        exit 1
    fi
    echo "NOT RUN: tsc, prettier and the JavaScript tests (no node on this machine)"
    exit 0
fi
[ -x node_modules/.bin/tsc ] || npm ci --silent --no-audit --no-fund
node_modules/.bin/tsc -p tsconfig.json
node_modules/.bin/prettier --check --log-level warn . ../r2c2r_core/export/review_page

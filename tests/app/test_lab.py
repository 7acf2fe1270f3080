"""Commands of docs/lab.md, run in order in one shell, with a local Postgres, store, provider and proxy."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from sqlmodel import select

from app.db.engine import opened, reading
from app.db.tables import Account, Project, Webhook
from r2c2r_core.cli import build_parser
from tests.app.object_server import BUCKET, object_server
from tests.app.people import PASSWORD
from tests.app.postgres import PostgresServer, programs
from tests.app.test_deploy import caddy
from tests.app.test_oidc import Identities, provider  # noqa: F401  # a fixture
from tests.ports import free_port
from tests.waiting import PATIENCE_S

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "lab.md"

# In place of separate terminals: servers keep running while the next line is typed, and end with Ctrl-C
SHELL = """
ended() { if [ -n "${!1:-}" ]; then kill "${!1}" && wait "${!1}" || true; fi; }
trap 'ended serving; ended seat; ended proxy' EXIT
answers() { until curl --silent --fail --max-time 60 --output /dev/null "$1"; do kill -0 "$2"; sleep 0.2; done; }
pip() { command python -m pip "$1" --quiet --no-index --disable-pip-version-check "${@:2}"; }
r2c2r() {
    case "$1" in
        serve) ended serving; python -m r2c2r_core.cli "$@" --port $PORT </dev/null & serving=$!
               answers "http://127.0.0.1:$PORT/healthz" $serving ;;
        work) ended seat; python -m r2c2r_core.cli "$@" </dev/null & seat=$! ;;
        db) if [ "$2" = move ]; then ended serving; serving=""; fi; python -m r2c2r_core.cli "$@" ;;
        *) python -m r2c2r_core.cli "$@" <<<"$PASSWORD" ;;
    esac
}
caddy() {
    if [ -z "$CADDY" ]; then return; fi
    "$CADDY" run --adapter caddyfile "${@:2}" 2>"$LOG" & proxy=$!
    answers "$ORIGIN/readyz" $proxy
}
"""


def lines() -> list[str]:
    """Every line of every block, as a person would type them."""
    return [line for block in re.findall(r"^```bash\n(.*?)^```$", PAGE.read_text(), re.M | re.S) for line in block.splitlines()]


def test_every_command_of_the_page_is_parsed_by_the_command_line() -> None:
    commands = [line for line in lines() if "r2c2r " in line]
    given = [found[1] for line in commands if (found := re.search(r"(?:^|\()r2c2r ([^)]*)", line))]
    assert len(given) > 10
    for words in given:
        known = build_parser().parse_args(shlex.split(words.replace("$project", "project")))
        assert callable(known.command), words


@pytest.mark.slow
def test_the_commands_of_the_page_run_in_order(
    provider: Identities,  # noqa: F811
    postgres_server: PostgresServer,
    tmp_path: Path,
) -> None:
    proxy = shutil.which("caddy")  # without it the server is addressed directly, and one line less is run
    port, tls_port, folder = free_port(), free_port(), tmp_path / "proxy"
    folder.mkdir()
    if proxy is not None:
        caddy(folder, tls_port, port)
    origin = f"https://localhost:{tls_port}" if proxy else f"http://localhost:{port}"
    database = f"postgresql+psycopg://r2c2r@/r2c2r?host={postgres_server.folder}"
    with object_server() as store:
        script = "\n".join(lines())
        for written, here in (
            ("postgresql+psycopg://r2c2r@db.lab.example/r2c2r", database),
            ("/srv/", f"{tmp_path}/"),
            ("https://kitchens.example", origin),
            ("kitchens.example", "localhost"),
            ("deploy/Caddyfile", str(folder / "Caddyfile")),
            ("s3://scans/", f"s3://{BUCKET}/"),
            ("https://s3.lab.example", store.endpoint),
            ("AWS_ACCESS_KEY_ID=KEY", f"AWS_ACCESS_KEY_ID={store.environment['AWS_ACCESS_KEY_ID']}"),
            ("AWS_SECRET_ACCESS_KEY=SECRET", f"AWS_SECRET_ACCESS_KEY={store.environment['AWS_SECRET_ACCESS_KEY']}"),
            ("https://id.lab.example", provider.issuer),
        ):
            assert written in script, f"{PAGE.name} does not say {written} any more"
            script = script.replace(written, here)
        known = {
            "PATH": f"{Path(sys.executable).parent}:{programs()}:{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT),
            "HOME": str(tmp_path),
            "PGHOST": str(postgres_server.folder),
            "PGUSER": "postgres",
            "PASSWORD": PASSWORD,
            "PORT": str(port),
            "ORIGIN": origin,
            "CADDY": proxy or "",
            "LOG": str(folder / "log"),
            "AWS_ALLOW_HTTP": "true",
            "LANG": "C.UTF-8",
        }
        if proxy is not None:
            known |= dict.fromkeys(("SSL_CERT_FILE", "CURL_CA_BUNDLE"), str(folder / "certificate.pem"))
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", f'set -x\n{SHELL}\n{script}\necho "project: $project"'],
            env=known,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S * 5,
            check=False,
        )
        assert done.returncode == 0, f"{done.stdout[-2000:]}\n{done.stderr[-6000:]}"
    assert f"{provider.issuer}/oauth2/authorize?" in done.stdout
    project = done.stdout.rsplit("project: ", 1)[1].strip()
    with opened(database) as engine, reading(engine) as session:
        assert [account.name for account in session.exec(select(Account))] == ["ann"]
        assert [(row.id, row.status) for row in session.exec(select(Project))] == [
            (project, "ready")
        ]  # by a seat, from the store
        assert [hook.project_id for hook in session.exec(select(Webhook))] == [project]
    assert (tmp_path / "rows.db").is_file()
    postgres_server.run("DROP DATABASE r2c2r")
    postgres_server.run("DROP ROLE r2c2r")

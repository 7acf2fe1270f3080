"""Files of deploy/: the proxies' on loopback TLS, with pages, sockets and uploads; the containers' by their contents.

No image can be built where tests run, so the paths and names in the containers' files are checked instead.
"""

import re
import shutil
import socket
import ssl
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import httpx2
import kubernetes_validate
import pytest
import yaml
from websockets.sync.client import connect

from app.main import create_app
from app.services import accounts, tokens
from app.settings import LOOPBACK, Settings
from r2c2r_core.cli import build_parser
from r2c2r_core.client import Server
from tests.app.conftest import FAKE_COMMANDS
from tests.app.people import PASSWORD
from tests.app.served import served
from tests.app.test_imports import archive
from tests.app.tls import certificate
from tests.ports import free_port
from tests.waiting import PATIENCE_S, until

DEPLOY = Path(__file__).resolve().parents[2] / "deploy"
NAME = "kitchens.example"
LARGE = archive(("metadata", b"{}"), ("rgbd/0.jpg", bytes(range(256)) * 2**14))  # of 4 MB, above every proxy's default limit


class Proxied:
    """A server behind a proxy that speaks TLS."""

    def __init__(self, port: int, certificate: Path, settings: Settings, app: object) -> None:
        self.origin, self.host = f"https://localhost:{port}", f"localhost:{port}"
        self.certificate, self.settings, self.app = certificate, settings, app
        self.trusted = ssl.create_default_context(cafile=str(certificate))


def with_line(site: str, known: str, instead: str) -> str:
    """The file with a directive replaced that occurs in it exactly once."""
    changed, count = re.subn(f"{known}.*", lambda _: instead, site)
    assert count == 1
    return changed


def nginx(folder: Path, port: int, behind: int, *, beside: int = 0, signs_in: bool = False) -> list[str]:
    made, key = certificate(folder)
    site = (DEPLOY / "nginx.conf").read_text()
    for written, here in (
        ("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"),
        ("listen 80", f"listen 127.0.0.1:{free_port()}"),
        (NAME, "localhost"),
        ("/etc/ssl/r2c2r/certificate.pem", str(made)),
        ("/etc/ssl/r2c2r/key.pem", str(key)),
        ("127.0.0.1:8000", f"127.0.0.1:{behind}"),
        *([("# server 10.0.0.2:8000", f"server 127.0.0.1:{beside}")] if beside else []),
    ):
        assert written in site
        site = site.replace(written, here)
    if signs_in:
        (folder / "people").write_text(f"ann:{{PLAIN}}{PASSWORD}\n")
        asks = f'auth_basic "r2c2r"; auth_basic_user_file {folder}/people; proxy_set_header X-Forwarded-User $remote_user;'
        site = with_line(site, r'proxy_set_header X-Forwarded-User "";', asks)
    (folder / "site.conf").write_text(site)
    places = "".join(f"{kind}_temp_path {folder}/{kind};" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
    whole = f"daemon off; master_process off; pid {folder}/pid; error_log {folder}/log; events {{}} "
    (folder / "nginx.conf").write_text(f"{whole} http {{ access_log off; {places} include {folder}/site.conf; }}")
    return ["-c", str(folder / "nginx.conf"), "-p", str(folder), "-e", str(folder / "log")]


def caddy(folder: Path, port: int, behind: int, *, beside: int = 0, signs_in: bool = False) -> list[str]:
    made, key = certificate(folder)
    site = (DEPLOY / "Caddyfile").read_text()
    named = f"{{$R2C2R_NAME:{NAME}}} {{"
    assert named in site
    site = site.replace(named, f"https://localhost:{port} {{\n\ttls {made} {key}")
    servers = f"127.0.0.1:{behind} 127.0.0.1:{beside}" if beside else f"127.0.0.1:{behind}"
    site = site.replace("{$R2C2R_AT:127.0.0.1:8000}", servers)
    if signs_in:
        command = [shutil.which("caddy") or "caddy", "hash-password", "--plaintext", PASSWORD]
        digest = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
        site = with_line(site, r"header_up -X-Forwarded-User", "header_up X-Forwarded-User {http.auth.user.id}")
        site = site.replace("\t@project", f"\tbasicauth {{\n\t\tann {digest}\n\t}}\n\t@project", 1)
    (folder / "Caddyfile").write_text("{\n\tadmin off\n\tauto_https disable_redirects\n}\n" + site)
    return ["run", "--config", str(folder / "Caddyfile"), "--adapter", "caddyfile"]


@pytest.fixture(params=["nginx", "caddy"])
def proxied(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Proxied]:
    with behind_proxy(request.param, tmp_path, monkeypatch) as found:
        yield found


@contextmanager
def behind_proxy(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, signs_in: bool = False) -> Iterator[Proxied]:
    """Use the file as it is; with `signs_in` the proxy asks for ann's password and passes on her name."""
    program = found(name)
    named = {"identity": "proxy:X-Forwarded-User", "trusted_proxies": ("127.0.0.1",)}
    settings = Settings(data_dir=tmp_path / "data", host="127.0.0.1", min_free_bytes=0, job_memory_bytes=0, **named)  # type: ignore[arg-type]
    app, port, folder = create_app(settings, commands=FAKE_COMMANDS), free_port(), tmp_path / "proxy"
    folder.mkdir()
    for place in ("HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.setenv(place, str(folder))
    with served(app) as behind:
        given = {"nginx": nginx, "caddy": caddy}[name](folder, port, behind, signs_in=signs_in)
        with proxy(program, given, port, folder):
            yield Proxied(port, folder / "certificate.pem", settings, app)


def found(name: str) -> str:
    """Path of the program; skips if it is missing."""
    program = shutil.which(name) or shutil.which(name, path="/usr/sbin")
    if program is None:
        pytest.skip(f"no {name} here: apt-get install {name}")
    return program


@contextmanager
def proxy(program: str, given: list[str], port: int, folder: Path) -> Iterator[None]:
    """Run the proxy, and wait until it listens."""
    with (folder / "said").open("wb") as said:
        process = subprocess.Popen([program, *given], stdout=said, stderr=said)
    try:
        until(lambda: process.poll() is not None or listens(port), f"{program} does not listen")
        assert process.poll() is None, (folder / "said").read_text()
        yield
    finally:
        process.kill()
        process.wait()


def listens(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S).close()
    except OSError:
        return False
    return True


def test_pages_websockets_and_uploads_pass_the_proxy(proxied: Proxied, monkeypatch: pytest.MonkeyPatch) -> None:
    with httpx2.Client(base_url=proxied.origin, verify=proxied.trusted, trust_env=False, timeout=PATIENCE_S) as client:
        entered = client.get(f"/?token={proxied.settings.launch_token}")
        assert "Secure" in entered.headers["set-cookie"]
        assert "strict-transport-security" in entered.headers
        assert client.get("/api/system").status_code == 200
        cookie = "; ".join(f"{name}={value}" for name, value in client.cookies.items())
    address = f"wss://{proxied.host}/api/live"
    with connect(
        address, ssl=proxied.trusted, origin=proxied.origin, additional_headers={"Cookie": cookie}, proxy=None
    ) as live:
        assert '"hello"' in live.recv(timeout=PATIENCE_S)
    monkeypatch.setenv("SSL_CERT_FILE", str(proxied.certificate))
    monkeypatch.setenv("no_proxy", "localhost")
    token = tokens.add(proxied.app.state.context.engine, None, "a script", "annotator")[0]  # type: ignore[attr-defined]
    scan = proxied.certificate.with_name("kitchen.r3d")
    scan.write_bytes(LARGE)
    project = Server(proxied.origin, token).upload(scan)
    assert (proxied.settings.data_dir / "projects" / project / "source" / "kitchen.r3d").read_bytes() == LARGE


def test_forwarded_address_headers_of_a_browser_are_ignored(proxied: Proxied) -> None:
    with httpx2.Client(base_url=proxied.origin, verify=proxied.trusted, trust_env=False, timeout=PATIENCE_S) as client:
        headers = {"X-Requested-With": "tests", "X-Forwarded-For": "203.0.113.9", "X-Forwarded-Proto": "http"}
        assert client.get("/?token=wrong", headers=headers).status_code == 401
        client.get(f"/?token={proxied.settings.launch_token}", headers=headers)
        lines = client.get("/api/audit").json()["entries"]
    assert {line["client"] for line in lines} == {"127.0.0.1"}


def test_user_headers_of_a_browser_do_not_pass_the_proxy(proxied: Proxied) -> None:
    with httpx2.Client(base_url=proxied.origin, verify=proxied.trusted, trust_env=False, timeout=PATIENCE_S) as client:
        for headers in ({"X-Forwarded-User": "ann"}, {"x-forwarded-user": "ann"}):
            assert client.get("/api/system", headers=headers).status_code == 401
    assert accounts.everyone(proxied.app.state.context.engine) == []  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["nginx", "caddy"])
def test_a_user_authenticated_by_the_proxy_is_signed_in_under_that_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (
        behind_proxy(name, tmp_path, monkeypatch, signs_in=True) as proxied,
        httpx2.Client(base_url=proxied.origin, verify=proxied.trusted, trust_env=False, timeout=PATIENCE_S) as client,
    ):
        said = {"X-Forwarded-User": "root"}
        assert client.get("/api/system", headers=said).status_code == 401
        assert client.get("/api/system", headers=said, auth=("ann", "wrong")).status_code == 401
        assert client.get("/api/system", headers=said, auth=("ann", PASSWORD)).json()["user"] == "ann"


@pytest.mark.parametrize("name", ["nginx", "caddy"])
def test_the_proxy_pins_views_uploads_and_projects_to_one_server(name: str, tmp_path: Path) -> None:
    program, port = found(name), free_port()
    with named_server("a") as a, named_server("b") as b:
        given = {"nginx": nginx, "caddy": caddy}[name](tmp_path, port, a, beside=b)
        trusted = ssl.create_default_context(cafile=str(tmp_path / "certificate.pem"))
        with (
            proxy(program, given, port, tmp_path),
            httpx2.Client(base_url=f"https://localhost:{port}", verify=trusted, trust_env=False, timeout=PATIENCE_S) as client,
        ):
            kept = ("/viewer/token/", "/api/projects/p/viewer/show", "/api/uploads", "/api/uploads/u")
            assert len({client.get(path).text for path in kept for _ in range(5)}) == 1
            of_one = ("/api/projects/p", "/api/projects/p/objects?x=1", "/media/p/frames/3.jpg")
            assert len({client.get(path).text for path in of_one for _ in range(5)}) == 1
            assert {client.get(f"/api/projects/{number}").text for number in range(40)} == {"a", "b"}
            assert {client.get("/api/system").text for _ in range(40)} == {"a", "b"}


@contextmanager
def named_server(name: str) -> Iterator[int]:
    """A server that returns its name for every request; its port."""

    class Named(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("content-length", str(len(name)))
            self.end_headers()
            self.wfile.write(name.encode())

        def log_message(self, *_: object) -> None:
            """Silence the log."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Named) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,))
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join()


def test_compose_services_use_existing_commands_volumes_and_files() -> None:
    compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
    services, server = compose["services"], compose["services"]["r2c2r"]
    given = build_parser().parse_args([part.replace("${R2C2R_NAME:?}", NAME) for part in server["command"]])
    subnet = compose["networks"]["default"]["ipam"]["config"][0]["subnet"]
    assert (given.host, given.behind_proxy) == ("0.0.0.0", [subnet])
    assert (DEPLOY / server["build"]["context"] / server["build"]["dockerfile"]).resolve() == DEPLOY / "Containerfile"
    mounted = [volume.split(":")[0] for service in services.values() for volume in service["volumes"]]
    assert {name for name in mounted if not name.startswith(".")} == set(compose["volumes"])
    assert all((DEPLOY / name).is_file() for name in mounted if name.startswith("."))
    for service in services.values():
        assert set(service.get("depends_on", ())) <= set(services)
    caddyfile = (DEPLOY / "Caddyfile").read_text()
    assert set(re.findall(r"\{\$(\w+)", caddyfile)) == set(services["caddy"]["environment"])
    assert "/readyz" in " ".join(server["healthcheck"]["test"])


def test_the_containerfile_refers_to_existing_scripts_and_extras() -> None:
    text = (DEPLOY / "Containerfile").read_text()
    root = DEPLOY.parent
    for path in re.findall(r"(?:bash|-c) (\S+\.(?:sh|txt))", text):
        assert (root / path).is_file(), path
    (extras,) = re.findall(r"'\.\[([\w,]+)\]'", text)
    assert {"postgres", "store"} <= set(extras.split(","))  # kubernetes.yaml's pods need both
    for extra in extras.split(","):
        assert f"\n{extra} = [" in (root / "pyproject.toml").read_text()
    assert "USER r2c2r" in text


def test_kubernetes_objects_are_valid_and_use_existing_commands() -> None:
    objects = list(yaml.safe_load_all((DEPLOY / "kubernetes.yaml").read_text()))
    kustomization = yaml.safe_load((DEPLOY / "kustomization.yaml").read_text())
    made = {entry["name"]: entry for entry in kustomization["configMapGenerator"]}
    settings = dict(text.split("=", 1) for text in made["settings"]["literals"])
    for each in objects:
        kubernetes_validate.validate(each, "1.37", strict=True)
    kinds = {(each["kind"], each["metadata"]["name"]): each["spec"] for each in objects}
    for kind, name in (("StatefulSet", "r2c2r"), ("Deployment", "seats"), ("Deployment", "caddy")):
        pod = kinds[kind, name]["template"]["spec"]
        (container,) = pod["containers"]
        assert kinds[kind, name]["selector"]["matchLabels"] == kinds[kind, name]["template"]["metadata"]["labels"]
        assert {mount["name"] for mount in container["volumeMounts"]} == {volume["name"] for volume in pod["volumes"]}
        if "args" in container:
            build_parser().parse_args([part.replace("$(R2C2R_NAME)", settings["R2C2R_NAME"]) for part in container["args"]])
    assert len(settings["R2C2R_AT"].split()) == kinds["StatefulSet", "r2c2r"]["replicas"]
    assert all(at.endswith(f".{kinds['StatefulSet', 'r2c2r']['serviceName']}:8000") for at in settings["R2C2R_AT"].split())
    assert all((DEPLOY / name).is_file() for name in [*kustomization["resources"], *made["caddyfile"]["files"]])
    known = (DEPLOY.parent / "app" / "settings.py").read_text() + (DEPLOY / "Caddyfile").read_text()
    assert all(name in known for name in settings)


def test_kubelet_probes_are_answered_with_200(tmp_path: Path) -> None:
    objects = list(yaml.safe_load_all((DEPLOY / "kubernetes.yaml").read_text()))
    (server,) = next(each for each in objects if each["kind"] == "StatefulSet")["spec"]["template"]["spec"]["containers"]
    settings = Settings(data_dir=tmp_path, allowed_hosts=(*LOOPBACK, NAME), accounts_only=True)
    with served(create_app(settings, commands=FAKE_COMMANDS)) as port:
        for probe in (server["readinessProbe"]["httpGet"], server["livenessProbe"]["httpGet"]):
            asked = {header["name"]: header["value"] for header in probe["httpHeaders"]}
            assert httpx2.get(f"http://127.0.0.1:{port}{probe['path']}", headers=asked).status_code == 200

"""Invalid settings of the object store are reported when a server or a seat starts; an unavailable store is waited for."""

from collections.abc import Callable
from pathlib import Path

import pytest

from app.serve import serve
from app.settings import Settings
from app.store.usable import refusal, require_store
from app.work import work
from r2c2r_core.errors import InputError
from tests.app.object_server import BUCKET, REQUIRED, ObjectServer
from tests.ports import free_port

if not REQUIRED:
    pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")


@pytest.fixture
def known(s3: ObjectServer, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in s3.environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("R2C2R_DATABASE", "postgresql+psycopg://nobody@127.0.0.1:9/none")  # checked after the store


def start_server(folder: Path) -> None:
    serve(host="127.0.0.1", port=0, data_dir=folder)


def start_seat(folder: Path) -> None:
    work(data_dir=folder)


@pytest.mark.parametrize("start", [start_server, start_seat])
@pytest.mark.parametrize(
    ("bucket", "setting", "value", "why", "next_step"),
    [
        (
            BUCKET,
            "AWS_SECRET_ACCESS_KEY",
            "wrong",
            "it refuses the credentials (SignatureDoesNotMatch)",
            "AWS_SECRET_ACCESS_KEY",
        ),
        (BUCKET, "AWS_ACCESS_KEY_ID", "nobody", "it refuses the credentials (InvalidAccessKeyId)", "AWS_ACCESS_KEY_ID"),
        ("nowhere", "AWS_REGION", "us-east-1", "there is no bucket nowhere", "make it, or name another one"),
        (BUCKET, "AWS_ALLOW_HTTP", "", "its endpoint has no TLS", "AWS_ALLOW_HTTP=true"),
    ],
)
def test_servers_and_seats_do_not_start_with_an_invalid_store(
    known: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    start: Callable[[Path], None],
    bucket: str,
    setting: str,
    value: str,
    why: str,
    next_step: str,
) -> None:
    if value:
        monkeypatch.setenv(setting, value)
    else:
        monkeypatch.delenv(setting)
    monkeypatch.setenv("R2C2R_STORE", f"s3://{bucket}/lab")
    with pytest.raises(InputError) as refused:
        start(tmp_path)
    assert refused.value.message == f"R2C2R_STORE s3://{bucket}/lab: {why}"
    assert next_step in refused.value.hint
    assert "\n" not in str(refused.value)


def test_a_valid_store_is_accepted_and_a_missing_bucket_is_not_created(known: None, s3: ObjectServer, tmp_path: Path) -> None:
    require_store(Settings(data_dir=tmp_path, store=f"s3://{BUCKET}/{tmp_path.name}"))
    require_store(Settings(data_dir=tmp_path, store=f"file://{tmp_path / 'store'}"))
    require_store(Settings(data_dir=tmp_path, store=""))
    for _ in range(2):
        with pytest.raises(InputError, match="no bucket"):
            require_store(Settings(data_dir=tmp_path, store="s3://nobody-made-this"))


def test_an_unreachable_store_is_logged_and_does_not_prevent_the_start(
    known: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{free_port()}")
    require_store(Settings(data_dir=tmp_path, store=f"s3://{BUCKET}/lab"))
    assert "does not answer, jobs wait" in caplog.text


def test_a_store_folder_below_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="R2C2R_STORE"):
        require_store(Settings(data_dir=tmp_path, store=f"file://{tmp_path / 'file' / 'store'}"))


@pytest.mark.parametrize(
    ("address", "said", "next_step"),
    [
        ("s3://b", "Error performing PUT http://169.254.169.254/latest/api/token", "set AWS_ACCESS_KEY_ID and"),
        ("gs://b", "Error performing GET http://metadata.google.internal/x", "set GOOGLE_APPLICATION_CREDENTIALS"),
        (
            "az://b",
            "non-2xx status code: 403 Forbidden: <Code>AuthenticationFailed</Code>",
            "check AZURE_STORAGE_ACCOUNT_NAME and",
        ),
        ("s3://b", "non-2xx status code: 400 Bad Request: <Code>AuthorizationHeaderMalformed</Code>", "check AWS_REGION"),
        ("file:///b", "Unable to open file: Permission denied (os error 13)", "give its folder to"),
    ],
)
def test_store_errors_are_mapped_to_a_hint_about_the_setting(address: str, said: str, next_step: str) -> None:
    wrong = refusal(address, said)
    assert wrong is not None
    assert wrong.hint.startswith(next_step)


def test_a_busy_store_is_not_a_refusal() -> None:
    assert refusal("s3://b", "non-2xx status code: 503 Service Unavailable: <Code>SlowDown</Code>") is None

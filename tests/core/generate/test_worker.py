"""serve_worker with the remote generator, over real sockets."""

import http.client
import threading

import numpy as np
import pytest

from r2c2r_core.errors import BackendUnavailable, Cancelled, EnvironmentProblem, GenerationFailed, InputError
from r2c2r_core.generate.completion import Completion
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.remote import Remote
from r2c2r_core.generate.serve_worker import MOST_REQUEST_BYTES, open_server
from r2c2r_core.generate.wire import Wish, decode_form, decode_wish, encode_form, encode_wish
from r2c2r_core.progress import Progress
from tests.core.generate.stub import QUICK, answering, box_glb, said, serving
from tests.waiting import PATIENCE_S, until


@pytest.fixture(scope="module")
def evidence(bottle_scene):
    return gather_evidence(*bottle_scene, 6)


def worker(make, token=""):
    return serving(open_server(make, name="completion", address=("127.0.0.1", 0), token=token))


def remote(address, **options):
    return Remote(url=f"{address}/v1/mesh", patience=QUICK, **options)


def test_a_remote_candidate_equals_the_local_one(evidence):
    here = Completion().make(evidence, "c0", 4)
    with worker(lambda wish, progress: Completion().make(*wish)) as address:
        there = remote(address).make(evidence, "c0", 4)
    assert there.generator == "remote:completion"
    assert there.frames == here.frames
    assert there.warnings == here.warnings
    assert there.mesh.faces.shape == here.mesh.faces.shape
    assert np.array_equal(there.mesh.texture, here.mesh.texture)
    assert there.watertight
    for name in ("mask_iou", "depth_residual_m", "seen_fraction"):
        assert there.metrics[name] == pytest.approx(here.metrics[name], rel=1e-4)
    # it arrives rotated, and the minimum box of a round object has another yaw
    assert there.metrics["volume_ratio"] == pytest.approx(here.metrics["volume_ratio"], rel=0.02)
    assert {name: there.parameters[name] for name in here.parameters} == here.parameters


def test_a_request_survives_encoding_and_decoding(evidence):
    wish = decode_wish(*encode_wish(Wish(evidence, "c0", 3)))
    assert (wish.candidate_id, wish.seed, wish.evidence.track.name) == ("c0", 3, "bottle_1")
    for sent, received in zip(evidence.pool, wish.evidence.pool, strict=True):
        assert np.array_equal(sent.rgb, received.rgb)
        assert np.array_equal(sent.mask, received.mask)
        assert np.array_equal(sent.depth_m, received.depth_m)
        assert np.array_equal(sent.world_from_camera.matrix, received.world_from_camera.matrix)
        assert (sent.rgb_camera, sent.frame_index, sent.is_cropped) == (
            received.rgb_camera,
            received.frame_index,
            received.is_cropped,
        )


def test_binary_parts_survive_multipart_encoding():
    parts = [("a", "x/y", bytes(range(256)) * 3), ("b", "x/y", b"\r\n--\r\n"), ("a", "x/y", b"")]
    assert decode_form(*encode_form(parts)) == {"a": [parts[0][2], b""], "b": [parts[1][2]]}


def test_a_multipart_form_of_httpx_is_decoded():
    httpx = pytest.importorskip("httpx")
    request = httpx.Request(
        "POST", "http://h/", files=[("image", ("a.png", b"\x89P\r\n")), ("image", ("b.png", b"2"))], data={"params": "{}"}
    )
    form = decode_form(request.headers["Content-Type"], request.read())
    assert form == {"params": [b"{}"], "image": [b"\x89P\r\n", b"2"]}


def test_a_generator_error_on_the_worker_raises_a_one_line_error(evidence):
    def broken(wish, progress):
        raise RuntimeError("CUDA out of memory\nTried to allocate")

    with worker(broken) as address, pytest.raises(GenerationFailed, match="CUDA out of memory Tried") as refusal:
        remote(address).make(evidence, "c0", 0)
    assert "\n" not in str(refusal.value)


def test_a_wrong_token_is_rejected_and_the_right_one_accepted(evidence, monkeypatch):
    made = []
    with worker(lambda wish, progress: made.append(wish) or Completion().make(*wish), token="good") as address:
        monkeypatch.setenv("R2C2R_GENERATOR_TOKEN", "bad")
        with pytest.raises(BackendUnavailable, match="refused the token"):
            remote(address).make(evidence, "c0", 0)
        assert not made
        monkeypatch.setenv("R2C2R_GENERATOR_TOKEN", "good")
        assert remote(address).make(evidence, "c0", 0).watertight


def test_cancelling_stops_the_worker(evidence):
    began, told = threading.Event(), threading.Event()

    def slow(wish, progress):
        began.set()
        try:
            until(progress.check, "nobody stopped it")
        except Cancelled:
            told.set()
            raise

    with worker(slow) as address:
        with pytest.raises(Cancelled):
            remote(address, progress=Progress(is_cancelled=began.is_set)).make(evidence, "c0", 0)
        assert told.wait(PATIENCE_S)


def test_a_mesh_with_a_wrong_checksum_is_rejected(evidence):
    def answer(method, path, headers, body):
        if method == "POST":
            return said(202, {"job": "1"})
        if path.endswith("artifacts/0"):
            return 200, {}, box_glb()
        return said(200, {"state": "done", "artifacts": [{"sha256": "0" * 64}]})

    with answering(answer) as (address, _), pytest.raises(GenerationFailed, match="damaged on its way"):
        remote(address).make(evidence, "c0", 0)


@pytest.mark.parametrize(
    ("method", "path", "headers", "status"),
    [
        ("GET", "/v1/health", {}, 200),
        ("GET", "/v1/jobs/none", {}, 404),
        ("DELETE", "/v1/jobs/none", {}, 404),
        ("POST", "/v1/other", {"Content-Length": "0"}, 404),
        ("POST", "/v1/mesh", {"Content-Length": "0"}, 422),
        ("POST", "/v1/mesh", {"Content-Length": str(MOST_REQUEST_BYTES + 1)}, 413),
        ("POST", "/v1/mesh", {}, 411),
    ],
)
def test_the_worker_answers_each_request_with_the_proper_status(method, path, headers, status):
    with worker(lambda wish, progress: None) as address:
        connection = http.client.HTTPConnection(address.removeprefix("http://"), timeout=PATIENCE_S)
        connection.putrequest(method, path)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        assert connection.getresponse().status == status
        connection.close()


def test_a_public_address_needs_a_token_and_a_used_port_is_reported():
    with pytest.raises(InputError, match="R2C2R_WORKER_TOKEN"):
        open_server(lambda wish, progress: None, name="completion", address=("0.0.0.0", 0), token="")
    with worker(lambda wish, progress: None) as address:
        port = int(address.rpartition(":")[2])
        with pytest.raises(EnvironmentProblem, match=str(port)):
            open_server(lambda wish, progress: None, name="completion", address=("127.0.0.1", port), token="")

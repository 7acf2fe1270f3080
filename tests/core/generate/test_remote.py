"""Remote generator with servers of both protocols, and with misbehaving servers."""

import base64
import contextlib
import http.client
import io
import json
import socket
import threading

import numpy as np
import pytest
from PIL import Image

from r2c2r_core.errors import BackendUnavailable, Cancelled, GenerationFailed
from r2c2r_core.generate import exchange
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.exchange import Patience
from r2c2r_core.generate.remote import Remote
from r2c2r_core.generate.stage import GENERATORS, GenerateConfig
from r2c2r_core.geometry.meshes import is_watertight, oriented_extents
from r2c2r_core.progress import Progress
from tests.core.generate.stub import QUICK, answering, box_glb, said
from tests.waiting import LOOK_S, PATIENCE_S, held, until


@pytest.fixture(scope="module")
def evidence(bottle_scene):
    return gather_evidence(*bottle_scene, 6)


def nim(address, **options):
    return Remote(url=f"{address}/v1/infer", patience=QUICK, **options)


def nim_answer(glb, reason="SUCCESS"):
    return said(200, {"artifacts": [{"base64": base64.b64encode(glb).decode(), "finishReason": reason, "seed": 7}]})


def test_a_nim_server_gets_masked_images_and_its_glb_becomes_a_candidate(evidence):
    with answering(lambda *request: nim_answer(box_glb())) as (address, asked):
        asset = nim(address).make(evidence, "c3", 5)
    method, path, _, body = asked[0]
    request = json.loads(body)
    assert (method, path) == ("POST", "/v1/infer")
    assert request["mode"] == "image"
    assert len(request["image"]) == len(asset.frames) >= 4
    assert request["multiimage_algo"] in ("stochastic", "multidiffusion")
    assert 10 <= request["ss_sampling_steps"] <= 50
    assert request["ss_cfg_scale"] <= 10
    assert request["seed"] > 0  # with 0 the server draws a seed, and the result is not reproducible
    assert None not in request.values()
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(request["image"][0].partition(",")[2]))))
    assert picture.shape[2] == 4
    assert set(np.unique(picture[..., 3])) == {0, 255}
    assert (asset.object_name, asset.candidate_id, asset.generator, asset.seed) == ("bottle_1", "c3", "remote:trellis-nim", 5)
    assert asset.watertight
    assert is_watertight(asset.mesh.vertices, asset.mesh.faces)
    extents = oriented_extents(asset.mesh.vertices)
    assert extents / extents[0] == pytest.approx([1, 0.75, 0.5], rel=1e-4)
    assert asset.mesh.texture.shape == (32, 32, 3)  # kept, not baked again


def test_candidates_use_distinct_and_reproducible_samples(evidence):
    with answering(lambda *request: nim_answer(box_glb())) as (address, asked):
        for candidate in ("c0", "c1", "c0"):
            nim(address).make(evidence, candidate, 0)
    first, other, again = (json.loads(body) for *_, body in asked)
    assert first == again
    assert first["seed"] != other["seed"]
    assert first["ss_cfg_scale"] != other["ss_cfg_scale"]


def test_a_busy_server_is_retried(evidence):
    answers = iter([said(503, {}, **{"Retry-After": "0"}), said(502, {}), nim_answer(box_glb())])
    with answering(lambda *request: next(answers)) as (address, asked):
        assert nim(address).make(evidence, "c0", 0).watertight
    assert len(asked) == 3


def test_a_permanently_busy_server_raises_a_one_line_error(evidence):
    busy = pytest.raises(BackendUnavailable, match=r"busy or down \(503\).*loading")
    with answering(lambda *request: said(503, {"detail": "loading"})) as (address, asked), busy as refusal:
        nim(address).make(evidence, "c0", 0)
    assert len(asked) == QUICK.tries
    assert "\n" not in str(refusal.value)


def test_an_unreachable_server_raises_an_error_with_its_address(evidence):
    with pytest.raises(BackendUnavailable, match=r"127\.0\.0\.1:9 cannot be reached.*start it"):
        nim("http://127.0.0.1:9").make(evidence, "c0", 0)


@pytest.mark.parametrize(
    ("answer", "kind", "message"),
    [
        (said(401, {}), BackendUnavailable, "refused the token.*R2C2R_GENERATOR_TOKEN"),
        (said(404, {}), BackendUnavailable, "has no /v1/infer"),
        (said(302, {}, Location="http://elsewhere"), BackendUnavailable, "has no /v1/infer"),
        (said(422, {"detail": "image: bad"}), GenerationFailed, "answered 422.*image: bad"),
        (said(500, {"detail": "CUDA out of memory\nlong trace"}), GenerationFailed, "answered 500.*CUDA"),
        ((200, {}, b"<html>"), GenerationFailed, "not JSON"),
        ((200, {}, b"[]"), GenerationFailed, "a JSON object expected"),
        (said(200, {}), GenerationFailed, "no mesh in its answer"),
        (said(200, {"artifacts": [{"base64": "!!"}]}), GenerationFailed, "no mesh in its answer"),
        (nim_answer(b"glTF", "CONTENT_FILTERED"), GenerationFailed, "CONTENT_FILTERED"),
        (nim_answer(b"glTF\x02\x00\x00\x00broken"), GenerationFailed, "not a readable GLB"),
    ],
)
def test_server_errors_raise_a_one_line_error_without_a_retry(evidence, answer, kind, message):
    with answering(lambda *request: answer) as (address, asked), pytest.raises(kind, match=message) as refusal:
        nim(address).make(evidence, "c0", 0)
    assert len(asked) == 1  # retrying would help with none of these
    assert "\n" not in str(refusal.value)


def test_an_oversized_response_is_rejected(evidence, monkeypatch):
    monkeypatch.setattr(exchange, "MOST_BYTES", 1000)
    with answering(lambda *request: (200, {}, b" " * 5000)) as (address, _), pytest.raises(GenerationFailed, match="over"):
        nim(address).make(evidence, "c0", 0)


def test_a_hanging_request_can_be_cancelled(evidence):
    stop, answered = threading.Event(), threading.Event()

    def hang(*request):
        stop.set()
        released.wait(PATIENCE_S)
        answered.set()
        return said(200, {})

    with answering(hang) as (address, _), held() as released:
        with pytest.raises(Cancelled):
            nim(address, progress=Progress(is_cancelled=stop.is_set)).make(evidence, "c0", 0)
        assert not answered.is_set()


def test_a_response_timeout_is_not_retried(evidence):
    def hang(*request):
        released.wait(PATIENCE_S)
        return said(200, {})

    impatient = Patience(connect_s=PATIENCE_S, answer_s=0.5, tries=3, first_wait_s=0.05)
    with answering(hang) as (address, asked), held() as released:
        with pytest.raises(BackendUnavailable, match="gave no answer in"):
            Remote(url=f"{address}/v1/infer", patience=impatient).make(evidence, "c0", 0)
        until(lambda: asked)  # the server may accept a request after its client has given up
    assert len(asked) == 1


def test_a_server_that_sends_its_answer_byte_by_byte_is_disconnected(evidence):
    def drip():
        connection, _ = listening.accept()
        with connection, contextlib.suppress(OSError):  # the other end closed the connection, as expected
            connection.sendall(b"HTTP/1.1 200 OK\r\nConnection: close\r\n\r\n")
            while not ended.wait(LOOK_S):
                connection.sendall(b"{")

    impatient = Patience(connect_s=0.2, answer_s=0.3, tries=1, first_wait_s=0.05)
    with socket.create_server(("127.0.0.1", 0)) as listening, held() as ended:
        thread = threading.Thread(target=drip, daemon=True)
        thread.start()
        with pytest.raises(BackendUnavailable, match="gave no answer in"):
            Remote(url=f"http://127.0.0.1:{listening.getsockname()[1]}/v1/infer", patience=impatient).make(evidence, "c0", 0)
        thread.join(PATIENCE_S)
        assert not thread.is_alive()


def test_a_connection_timeout_is_retried(evidence, monkeypatch):
    tries = []

    def connect(self):
        tries.append(self)
        raise TimeoutError("timed out")

    monkeypatch.setattr(http.client.HTTPConnection, "connect", connect)
    with pytest.raises(BackendUnavailable, match=r"cannot be reached \(timed out\)"):
        nim("http://127.0.0.1:9").make(evidence, "c0", 0)
    assert len(tries) == QUICK.tries


def test_the_token_is_sent_in_the_header_and_url_passwords_are_rejected(evidence, monkeypatch):
    monkeypatch.setenv("R2C2R_GENERATOR_TOKEN", "secret")
    with answering(lambda *request: nim_answer(box_glb())) as (address, asked):
        nim(address).make(evidence, "c0", 0)
    assert asked[0][2]["Authorization"] == "Bearer secret"
    with pytest.raises(BackendUnavailable, match="holds a password"):
        Remote(url="http://user:pw@host/v1/infer")


@pytest.mark.parametrize("url", ["", "gpu-machine", "ftp://host/v1/mesh", "http://host", "http://host/generate"])
def test_a_url_without_a_known_endpoint_is_rejected(url):
    with pytest.raises(BackendUnavailable, match="v1/mesh") as refusal:
        Remote(url=url)
    assert "\n" not in str(refusal.value)


def test_the_remote_generator_is_available_only_with_a_configured_url(monkeypatch):
    monkeypatch.delenv("R2C2R_GENERATOR_URL", raising=False)
    assert GENERATORS.available("remote") == (False, "no server configured: set R2C2R_GENERATOR_URL")
    monkeypatch.setenv("R2C2R_GENERATOR_URL", "http://gpu:9000/v1/mesh")
    assert GENERATORS.available("remote") == (True, "ready")
    assert GenerateConfig().url == "http://gpu:9000/v1/mesh"

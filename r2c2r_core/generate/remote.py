"""Generator on another machine, over HTTP. The path of the address selects the protocol:

`…/v1/mesh`   ours, for any generator behind serve_worker.py:
    POST   /v1/mesh                        the form of wire.py -> 202 {"job": id}
    GET    /v1/jobs/{id}                   -> {"state": "queued|running|done|failed|cancelled", "error": text,
                                               "artifacts": [{"bytes": n, "sha256": hex, "generator": name, "frames": [int],
                                               "parameters": {name: number}, "metrics": {}, "warnings": [text],
                                               "assumes": text}]}
    GET    /v1/jobs/{id}/artifacts/{n}     -> the mesh as GLB
    DELETE /v1/jobs/{id}                   cancel: the result is no longer needed
`…/v1/infer`  TRELLIS as NVIDIA NIM (nvcr.io/nim/microsoft/trellis, variant large:image): one JSON request, one answer
    {"artifacts": [{"base64": …, "finishReason": "SUCCESS"|…, "seed": n}]}. NVIDIA's hosted address takes only its own
    example pictures, so the container must be one's own.

The address is `generate.url` (or R2C2R_GENERATOR_URL), a token R2C2R_GENERATOR_TOKEN.
"""

import base64
import binascii
import contextlib
import hashlib
import os
import time
from dataclasses import replace
from typing import Any
from urllib.parse import urlsplit

from r2c2r_core.errors import BackendUnavailable, GenerationFailed, OverrideError, R2C2RError
from r2c2r_core.generate.cutout import png_of, rgba_cutout
from r2c2r_core.generate.delivered import delivered_asset
from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.exchange import Endpoint, Patience, ask, ask_json, json_object
from r2c2r_core.generate.meshfile import MeshPart, parts_of_glb
from r2c2r_core.generate.protocol import MeshGenerator
from r2c2r_core.generate.sampling import Sampling, draw_sampling
from r2c2r_core.generate.wire import Wish, encode_wish
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.texts import fault_of

OURS, NIM = "/v1/mesh", "/v1/infer"

_POLL_S = 1.0
_NIM_PX = 768  # it crops to 518; base64 of eight larger pictures would pass 10 MB


class Remote(MeshGenerator):
    """Client that obtains candidates from a server."""

    def __init__(self, *, url: str, patience: Patience | None = None, progress: Progress = SILENT) -> None:
        if not url:
            raise BackendUnavailable(
                "generator 'remote' has no address",
                hint="set generate.url (or R2C2R_GENERATOR_URL) to http://host:port/v1/mesh or http://host:port/v1/infer",
            )
        token = os.environ.get("R2C2R_GENERATOR_TOKEN", "")
        self._endpoint = Endpoint(url=url, token=token, patience=patience or Patience())
        self._path = urlsplit(url).path.rstrip("/")
        self._progress = progress
        if not self._path.endswith((OURS, NIM)):
            raise BackendUnavailable(
                f"generate.url ends in '{self._path}'", hint=f"the protocol is named by the path: {OURS} (ours) or {NIM} (NIM)"
            )

    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        """One candidate; raises GenerationFailed when the server fails on it, BackendUnavailable when it cannot be used."""
        if self._path.endswith(NIM):
            return self._from_nim(evidence, candidate_id, seed)
        return self._from_worker(evidence, candidate_id, seed)

    def _from_nim(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        sampling = draw_sampling(evidence, candidate_id, seed)
        answer = ask_json(self._endpoint, "POST", self._path, _nim_request(sampling), progress=self._progress)
        return delivered_asset(
            self._parts(_nim_mesh(answer, self._endpoint)),
            object_name=evidence.track.name,
            candidate_id=candidate_id,
            generator="remote:trellis-nim",
            seed=seed,
            frames=sampling.frames,
            parameters=sampling.parameters,
        )

    def _from_worker(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        content_type, body = encode_wish(Wish(evidence, candidate_id, seed))
        accepted = json_object(
            self._endpoint, ask(self._endpoint, "POST", self._path, body, content_type, progress=self._progress)
        )
        if "job" not in accepted:
            raise GenerationFailed(f"generator at {self._endpoint.where}: no job in its answer")
        job = f"{self._path.removesuffix('mesh')}jobs/{accepted['job']}"
        artifact = self._wait(job)
        content = ask(self._endpoint, "GET", f"{job}/artifacts/0", progress=self._progress)
        if hashlib.sha256(content).hexdigest() != artifact.get("sha256"):
            raise GenerationFailed(f"generator at {self._endpoint.where}: the mesh was damaged on its way")
        return delivered_asset(
            self._parts(content),
            object_name=evidence.track.name,
            candidate_id=candidate_id,
            generator=f"remote:{artifact.get('generator', 'unknown')}",
            seed=seed,
            frames=tuple(int(frame) for frame in artifact.get("frames", ())),
            parameters=_numbers(artifact.get("parameters")),
            metrics=_numbers(artifact.get("metrics")),
            warnings=tuple(str(line)[:300] for line in artifact.get("warnings", ())),
            assumes=str(artifact.get("assumes", ""))[:300],
        )

    def _wait(self, job: str) -> dict[str, Any]:
        """First artifact of a job once it is done; on failure or cancellation the job is deleted on the server."""
        until = time.monotonic() + self._endpoint.patience.answer_s
        try:
            while True:
                state = ask_json(self._endpoint, "GET", job, progress=self._progress)
                if state.get("state") == "done" and state.get("artifacts"):
                    return dict(state["artifacts"][0])
                if state.get("state") not in ("queued", "running"):
                    said = str(state.get("error") or state.get("state"))[:300]
                    raise GenerationFailed(f"generator at {self._endpoint.where}: {' '.join(said.split())}")
                if time.monotonic() > until:
                    raise GenerationFailed(
                        f"generator at {self._endpoint.where}: no mesh after {self._endpoint.patience.answer_s:.0f} s"
                    )
                self._rest()
        except R2C2RError:
            leave_s = self._endpoint.patience.leave_s
            once = replace(self._endpoint, patience=Patience(connect_s=leave_s, answer_s=leave_s, tries=1))
            with contextlib.suppress(R2C2RError):
                ask(once, "DELETE", job)
            raise

    def _rest(self) -> None:
        self._progress.check()
        time.sleep(min(_POLL_S, self._endpoint.patience.first_wait_s))

    def _parts(self, glb: bytes) -> list[MeshPart]:
        try:
            return parts_of_glb(glb, f"answer of {self._endpoint.where}")
        except OverrideError as error:
            raise GenerationFailed(error.message, hint=error.hint) from error


def _nim_request(sampling: Sampling) -> dict[str, Any]:
    """Request body of the NIM; an absent field must be omitted, since null counts as present."""
    pictures = [
        "data:image/png;base64," + base64.b64encode(png_of(rgba_cutout(view, _NIM_PX))).decode() for view in sampling.views
    ]
    several = {"multiimage_algo": sampling.mode} if len(pictures) > 1 else {}
    return {
        "mode": "image",
        "image": pictures if several else pictures[0],
        **several,
        "ss_sampling_steps": sampling.structure_steps,
        "slat_sampling_steps": sampling.latent_steps,
        "ss_cfg_scale": sampling.structure_guidance,
        "slat_cfg_scale": sampling.latent_guidance,
        "samples": 1,
        "seed": sampling.seed,
        "no_texture": False,
        "output_format": "glb",
    }


def _nim_mesh(answer: dict[str, Any], endpoint: Endpoint) -> bytes:
    """The GLB in the NIM's response."""
    try:
        artifact = answer["artifacts"][0]
        reason = artifact.get("finishReason", "SUCCESS")
        if reason != "SUCCESS":
            raise GenerationFailed(f"generator at {endpoint.where}: finished with {reason}")
        return base64.b64decode(artifact["base64"], validate=True)
    except (KeyError, IndexError, TypeError, AttributeError, binascii.Error) as error:
        raise GenerationFailed(f"generator at {endpoint.where}: no mesh in its answer ({fault_of(error)})") from error


def _numbers(entry: Any) -> dict[str, float]:
    """The numeric values of a JSON object; other values are dropped."""
    items = entry.items() if isinstance(entry, dict) else ()
    return {str(key): float(value) for key, value in items if isinstance(value, int | float)}

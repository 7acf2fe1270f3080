"""Train the seam network on elevations drawn at random, and write it as ONNX.

    pip install onnx
    python -m training.train --minutes 60 --out r2c2r_core/segment/runs/panel_net_3.onnx

Workers draw; crops of 1.28 m go through a buffer of a few thousand, each seen several times, mirrored or not. The learning rate
follows the clock to zero; what is written is the mean of the weights over the last part. Needs torch; a run on two cores of a
laptop is enough.
"""

import argparse
import math
import multiprocessing
import time
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import nn

from training.crops import crops
from training.panel_net import INPUTS, PanelNet

BATCH, LEARNING_RATE, BUFFER = 8, 2e-3, 4000
AVERAGED_FROM = 0.85  # of the time: from there on weights are averaged, once a minute


def main() -> None:
    """Train for so many minutes."""
    parser = argparse.ArgumentParser(description="Train the seam network.")
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--resume", type=Path, help="weights (.pt) to go on from")
    parser.add_argument("--rate", type=float, default=LEARNING_RATE, help="learning rate to begin with")
    parser.add_argument("--seed", type=int, default=0, help="of the first elevation: another one draws others")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    context = multiprocessing.get_context("spawn")
    queue = context.Queue(maxsize=64)
    workers = [
        context.Process(target=_drawer, args=(queue, options.seed + k, options.workers), daemon=True)
        for k in range(options.workers)
    ]
    for worker in workers:
        worker.start()
    network = train(queue, options.minutes * 60, options.rate, options.out, options.resume)
    export(network, options.out)
    for worker in workers:
        worker.terminate()


def _drawer(queue: multiprocessing.Queue, first: int, step: int) -> None:
    cv2.setNumThreads(1)
    seed = first
    while True:
        try:
            for crop in crops(seed):
                queue.put(crop)
        except Exception as fault:
            print(f"elevation {seed}: {fault!r}", flush=True)
        seed += step


def train(queue: multiprocessing.Queue, seconds: float, rate: float, out: Path, resume: Path | None) -> PanelNet:
    """Until the time is over; the learning rate goes with it."""
    network = PanelNet().to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    if resume is not None:
        network.load_state_dict(torch.load(resume))
    optimizer = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=1e-3)
    buffer: list[tuple[np.ndarray, np.ndarray]] = [queue.get() for _ in range(4 * BATCH)]
    rng = np.random.default_rng(0)
    averaged = torch.optim.swa_utils.AveragedModel(network, use_buffers=True)
    started, said, losses, step, drawn = time.monotonic(), 0.0, [], 0, len(buffer)
    while (elapsed := time.monotonic() - started) < seconds:
        while not queue.empty():
            crop = queue.get()
            drawn += 1
            if len(buffer) < BUFFER:
                buffer.append(crop)
            else:
                buffer[int(rng.integers(BUFFER))] = crop
        inputs, truth = _batch(buffer, rng)
        share = elapsed / seconds
        for group in optimizer.param_groups:
            group["lr"] = rate * min(1.0, step / 50 + 0.02) * 0.5 * (1 + math.cos(math.pi * share))
        with torch.autocast("cpu", dtype=torch.bfloat16):
            odds = network(inputs)
        loss = _loss(odds.float(), truth)
        optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimizer.step()
        losses.append(loss.item())
        step += 1
        if elapsed - said > 60:
            said = elapsed
            print(f"{elapsed:6.0f} s, step {step}, {drawn} crops, loss {np.mean(losses[-50:]):.4f}", flush=True)
            if share > AVERAGED_FROM:
                averaged.update_parameters(network)
            torch.save(network.state_dict(), out.with_suffix(".pt"))
    averaged.update_parameters(network)
    return averaged.module


def _batch(buffer: list[tuple[np.ndarray, np.ndarray]], rng: np.random.Generator) -> tuple[torch.Tensor, torch.Tensor]:
    chosen = [buffer[int(k)] for k in rng.integers(len(buffer), size=BATCH)]
    pairs = [_mirrored(*pair) if rng.random() < 0.5 else pair for pair in chosen]
    inputs = np.stack([pair[0] for pair in pairs]).astype(np.float32)
    truth = np.stack([pair[1] for pair in pairs])
    return torch.from_numpy(inputs).to(memory_format=torch.channels_last), torch.from_numpy(truth.astype(np.int64))


def _mirrored(inputs: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left is right: the two columns of cells within each larger one change places too."""
    inputs = inputs[:, :, ::-1]
    parts = inputs[:16].reshape(2, 2, 4, *inputs.shape[1:])[:, ::-1].reshape(16, *inputs.shape[1:])
    return np.concatenate([parts, inputs[16:]]), truth[:, :, ::-1]


def _loss(odds: torch.Tensor, truth: torch.Tensor) -> torch.Tensor:
    """Binary cross-entropy: its minimum is at the true odds. Lines are rare, so they weigh more in sum, not in odds."""
    known = (truth != 2).float()
    each = nn.functional.binary_cross_entropy_with_logits(odds, (truth == 1).float(), reduction="none") * known
    means = each.sum(dim=(0, 2, 3)) / known.sum(dim=(0, 2, 3)).clamp(min=1)
    return (means * torch.tensor([8.0, 8.0, 3.0, 1.0])).sum()


def export(network: PanelNet, out: Path) -> None:
    """As ONNX, of any height and width."""
    network.eval()
    example = torch.zeros(1, INPUTS, 64, 64)
    torch.onnx.export(
        network,
        (example,),
        str(out),
        input_names=["features"],
        output_names=["odds"],
        dynamic_axes={"features": {2: "rows", 3: "columns"}, "odds": {2: "rows", 3: "columns"}},
        opset_version=17,
        dynamo=False,
    )


if __name__ == "__main__":
    main()

"""Train the ensemble of seam networks on elevations drawn at random, and write it as ONNX.

    pip install onnx 'torch==2.13.0'
    python -m training.train --minutes 60 --out r2c2r_core/segment/mosaics

Workers draw; crops of 1.28 m go through a pool, each seen several times, mirrored or not. All networks learn from the same
pool, each from its own weights and its own batches. The learning rate follows the clock to zero; what is written is the mean of
the weights over the last part. Two cores of a laptop do; with `--device cuda` the drawing is what takes the time: one worker a
core.
"""

import argparse
import math
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor, multiprocessing, nn

from training.crops import SIZE, crops
from training.panel_net import INPUTS, OUTPUTS, PanelNet

LEARNING_RATE = 2e-3
AVERAGED_FROM, AVERAGED_EVERY = 0.85, 0.005  # of the time: from there on weights are averaged, so often
HELD_OUT = range(20_000_000, 20_000_012)  # elevations that no training draws
WARM_UP = 50  # steps


def main() -> None:
    """Train for so many minutes."""
    parser = argparse.ArgumentParser(description="Train the seam networks.")
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--networks", type=int, default=2)
    parser.add_argument("--workers", type=int, default=1, help="processes that draw")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--pool", type=int, default=4000, help="crops that are kept, 2.8 MB each, on the device")
    parser.add_argument("--rate", type=float, default=LEARNING_RATE, help="learning rate to begin with")
    parser.add_argument("--seed", type=int, default=0, help="of the first elevation: another one draws others")
    parser.add_argument("--out", type=Path, required=True, help="folder to write panel_net_*.onnx and their weights into")
    parser.add_argument("--resume", type=Path, help="folder with weights (panel_net_*.pt) to go on from")
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    context = multiprocessing.get_context("spawn")
    queue = context.Queue(maxsize=4 * options.workers)
    drawers = [
        context.Process(target=_draw, args=(queue, options.seed + k, options.workers), daemon=True)
        for k in range(options.workers)
    ]
    for drawer in drawers:
        drawer.start()
    networks = [PanelNet().to(options.device, memory_format=torch.channels_last) for _ in range(options.networks)]
    for number, network in enumerate(networks if options.resume else (), 1):
        network.load_state_dict(torch.load(options.resume / f"panel_net_{number}.pt", map_location=options.device))
    pool = Pool(options.pool, options.device)
    options.out.mkdir(parents=True, exist_ok=True)
    trained = train(networks, pool, queue, options.out, seconds=options.minutes * 60, rate=options.rate, batch=options.batch)
    for drawer in drawers:
        drawer.terminate()
    keep(trained, options.out)
    for number, network in enumerate(trained, 1):
        export(network, options.out / f"panel_net_{number}.onnx")


def _draw(queue: multiprocessing.Queue, first: int, step: int) -> None:
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    seed = first
    while True:
        try:
            queue.put(_tensors(crops(seed)))
        except Exception as fault:  # one that cannot be drawn is not worth the training
            print(f"elevation {seed}: {fault!r}", flush=True)
        seed += step


def _tensors(found: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[Tensor, Tensor]:
    inputs, truth = (np.stack(layers) for layers in zip(*found, strict=True))
    return torch.from_numpy(inputs), torch.from_numpy(truth)


class Pool:
    """The crops drawn last, on the device that trains."""

    def __init__(self, most: int, device: str) -> None:
        self.device, self.drawn = device, 0
        self._inputs = torch.empty((most, INPUTS, SIZE, SIZE), dtype=torch.float16, device=device)
        self._truth = torch.empty((most, OUTPUTS, SIZE, SIZE), dtype=torch.uint8, device=device)

    def take(self, inputs: Tensor, truth: Tensor) -> None:
        """The oldest go."""
        at = (self.drawn + torch.arange(len(inputs), device=self.device)) % len(self._inputs)
        self._inputs[at], self._truth[at] = inputs.to(self.device), truth.to(self.device)
        self.drawn += len(inputs)

    def batch(self, size: int) -> tuple[Tensor, Tensor]:
        """Crops at random, half of them mirrored: (size, 19, 256, 256) and (size, 4, 256, 256)."""
        chosen = torch.randint(min(self.drawn, len(self._inputs)), (size,), device=self.device)
        inputs, truth, half = self._inputs[chosen].float(), self._truth[chosen], size // 2
        inputs[:half], truth[:half] = mirrored(inputs[:half]), truth[:half].flip(-1)
        return inputs.contiguous(memory_format=torch.channels_last), truth


def mirrored(inputs: Tensor) -> Tensor:
    """Left is right (n, 19, rows, columns): the two columns of cells within each larger one change places too."""
    inputs = inputs.flip(-1)
    parts = inputs[:, :16].reshape(-1, 2, 2, 4, *inputs.shape[2:]).flip(2).reshape(-1, 16, *inputs.shape[2:])
    return torch.cat([parts, inputs[:, 16:]], dim=1)


def keep(networks: Sequence[PanelNet], out: Path) -> None:
    """Their weights, which a training may go on from."""
    for number, network in enumerate(networks, 1):
        torch.save(network.state_dict(), out / f"panel_net_{number}.pt")


def train(
    networks: Sequence[PanelNet],
    pool: Pool,
    queue: multiprocessing.Queue,
    out: Path,
    *,
    seconds: float,
    rate: float,
    batch: int,
) -> list[PanelNet]:
    """Until the time is over; the learning rate goes with it. Weights are kept as it goes, so that no fault takes all of it."""
    optimizers = [torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=1e-3) for network in networks]
    averaged = [torch.optim.swa_utils.AveragedModel(network) for network in networks]
    while pool.drawn < 4 * batch:
        pool.take(*queue.get())
    started, step, said, kept = time.monotonic(), 0, 0.0, AVERAGED_FROM
    while (share := (time.monotonic() - started) / seconds) < 1:
        while not queue.empty():
            pool.take(*queue.get())
        step += 1
        now = rate * min(1.0, step / WARM_UP) * 0.5 * (1 + math.cos(math.pi * share))
        losses = [_step(*pair, *pool.batch(batch), now) for pair in zip(networks, optimizers, strict=True)]
        if share > kept:
            kept += AVERAGED_EVERY
            for mean, network in zip(averaged, networks, strict=True):
                mean.update_parameters(network)
        if share > said:
            said += 0.05
            keep(networks, out)
            told = ", ".join(f"{loss.item():.4f}" for loss in losses)
            print(f"{share:4.0%}, step {step}, {pool.drawn} crops, losses {told}", flush=True)
    trained = [mean.module for mean in averaged]
    print("held out:", ", ".join(f"{held_out(network, pool.device):.4f}" for network in trained), flush=True)
    return trained


def _step(network: PanelNet, optimizer: torch.optim.Optimizer, inputs: Tensor, truth: Tensor, rate: float) -> Tensor:
    for group in optimizer.param_groups:
        group["lr"] = rate
    with torch.autocast(inputs.device.type, dtype=torch.bfloat16):
        odds = network(inputs)
    loss = _loss(odds.float(), truth)
    optimizer.zero_grad()
    loss.backward()
    nn.utils.clip_grad_norm_(network.parameters(), 5.0)
    optimizer.step()
    return loss.detach()


def _loss(odds: Tensor, truth: Tensor) -> Tensor:
    """Binary cross-entropy: its minimum is at the true odds. Lines are rare, so they weigh more in sum, not in odds."""
    known = (truth != 2).float()
    each = nn.functional.binary_cross_entropy_with_logits(odds, (truth == 1).float(), reduction="none") * known
    means = each.sum(dim=(0, 2, 3)) / known.sum(dim=(0, 2, 3)).clamp(min=1)
    return (means * torch.tensor([8.0, 8.0, 3.0, 1.0], device=odds.device)).sum()


@torch.no_grad()
def held_out(network: PanelNet, device: str) -> float:
    """The loss on elevations that nothing was trained on."""
    network.eval()
    each = [_tensors(crops(seed)) for seed in HELD_OUT]
    losses = [_loss(network(inputs.float().to(device)).float(), truth.to(device)) for inputs, truth in each]
    return float(torch.stack(losses).mean())


def export(network: PanelNet, out: Path) -> None:
    """As ONNX, of any height and width."""
    network.eval().to("cpu")
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

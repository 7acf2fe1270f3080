"""The seam network: a small U-Net over an orthomosaic and its relief."""

import itertools

import torch
from torch import Tensor, nn

CHANNELS = (16, 32, 48, 64, 96)
INPUTS, OUTPUTS = 19, 4


class PanelNet(nn.Module):
    """(n, 19, h, w) features on 5 mm cells, h and w multiples of 16, to (n, 4, h, w) log-odds.

    Outputs: upright edges of fronts, level edges, handles, fronts. Receptive field about a metre.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Sequential(_conv(INPUTS, CHANNELS[0]), _conv(CHANNELS[0], CHANNELS[0]))
        pairs = list(itertools.pairwise(CHANNELS))
        self.down = nn.ModuleList(nn.Sequential(_conv(a, b, stride=2), _conv(b, b)) for a, b in pairs)
        self.wide = nn.Sequential(_conv(CHANNELS[-1], CHANNELS[-1], dilation=2), _conv(CHANNELS[-1], CHANNELS[-1], dilation=4))
        self.up = nn.ModuleList(nn.Conv2d(b, a, 1) for a, b in reversed(pairs))
        self.merge = nn.ModuleList(_conv(2 * a, a) for a, _ in reversed(pairs))
        self.head = nn.Conv2d(CHANNELS[0], OUTPUTS, 1)
        nn.init.constant_(self.head.bias, -3.0)

    def forward(self, features: Tensor) -> Tensor:
        kept = [self.stem(features)]
        for step in self.down:
            kept.append(step(kept[-1]))
        x = kept.pop()
        x = x + self.wide(x)
        for up, merge in zip(self.up, self.merge, strict=True):
            x = nn.functional.interpolate(up(x), scale_factor=2.0, mode="nearest")
            x = merge(torch.cat([x, kept.pop()], dim=1))
        logits: Tensor = self.head(x)
        return logits


def _conv(a: int, b: int, *, stride: int = 1, dilation: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(a, b, 3, stride=stride, padding=dilation, dilation=dilation, bias=False), nn.BatchNorm2d(b), nn.ReLU()
    )

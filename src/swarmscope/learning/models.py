"""The networks: encoder (GIWT 4.3.1), four ways to fuse what robots see, and the mapper to a direction (4.3.3).

All have one face: ``encode(maps) -> features`` runs on every robot for itself, ``decide(features, cells, gains,
present) -> logits`` on the robot that decides. Column 0 of the logits is left, 1 right.

=========  ==========================================================================================
giwt       graph attention with position embedding and information gain (4)-(9)
gat        graph attention (Velickovic et al. 2018; PyTorch Geometric's GATConv)
graphsage  mean of the neighbours (Hamilton et al. 2017; PyTorch Geometric's SAGEConv)
cnn        the robot's own features only
=========  ==========================================================================================

Readings of what is printed: (6) scores a pair by a learnt vector applied to LeakyReLU of the sum of both transformed
features, with its own bias-free matrix for either end (GATv2, Brody et al. 2022). (9) has the matrix W of (5) a second
time; we take another one, as W PF of W f + PE would only make W squared. beta of a robot to itself is 0, sigma is ReLU.

Three things go beyond the print, as in the peers' layers, and are left out with ``as_printed``: HEADS heads of
attention; the robot's own features have a matrix of their own in (9), or they drown in the neighbours' (graphsage has
one, gat gets one); LeakyReLU in (5), because else (9) sees positions as a constant, whatever the neighbour there sees.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor, nn

from swarmscope.onboard.network.graph import FEATURES, GRID
from swarmscope.onboard.network.local_map import CELLS, CHANNELS

Network = Literal["giwt", "gat", "graphsage", "cnn"]
NETWORKS: tuple[Network, ...] = ("giwt", "gat", "graphsage", "cnn")
HIDDEN = 16
"""Width of the mapper's middle layer."""
HEADS = 4
"""Of attention in giwt and gat; each has FEATURES / HEADS channels."""
SLOPE = 0.2
"""Of the leaky part of LeakyReLU."""
FAR_BELOW = -1e9


@dataclass(frozen=True)
class Architecture:
    """What a checkpoint must agree in to be loaded."""

    network: Network = "giwt"
    channels: tuple[int, ...] = (16, 32, 64)
    """Channels of the encoder's three blocks."""
    stem_stride: int = 2
    """Stride of the first convolution: 2 (kernel 5) takes a CPU a quarter of the time, 1 (kernel 3) is mini-VGG."""
    use_gain: bool = True
    """giwt: with beta of (8)."""
    use_position: bool = True
    """giwt: with the position embedding (4)."""
    as_printed: bool = False
    """giwt: one head, own features only as one of the robots, (5) linear."""
    dropout: float = 0.0
    """Of the features before the mapper."""


class Encoder(nn.Module):
    """Three blocks of conv-BN-ReLU-maxpool and conv-BN-ReLU, then a linear layer to FEATURES (3)."""

    def __init__(self, channels: tuple[int, ...], stem_stride: int) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        width = CHANNELS
        for k, wide in enumerate(channels):
            stem = k == 0 and stem_stride == 2
            kernel, stride = (5, 2) if stem else (3, 1)
            layers += [nn.Conv2d(width, wide, kernel, stride, kernel // 2, bias=False), nn.BatchNorm2d(wide), nn.ReLU()]
            layers += [nn.MaxPool2d(2), nn.Conv2d(wide, wide, 3, 1, 1, bias=False), nn.BatchNorm2d(wide), nn.ReLU()]
            width = wide
        self.blocks = nn.Sequential(*layers, nn.Flatten())
        with torch.no_grad():
            self.eval()
            flat = self.blocks(torch.zeros(1, CHANNELS, CELLS, CELLS)).shape[1]
            self.train()
        self.linear = nn.Linear(flat, FEATURES)

    def forward(self, maps: Tensor) -> Tensor:
        """Return features (B, F) of maps (B, CHANNELS, CELLS, CELLS)."""
        out: Tensor = self.linear(self.blocks(maps))
        return out


class Giwt(nn.Module):
    """Graph attention with information gain weight (4)-(9), for the decider, who is robot 0 of each row."""

    def __init__(self, use_gain: bool, use_position: bool, as_printed: bool) -> None:
        super().__init__()
        self.use_gain = use_gain
        self.heads = 1 if as_printed else HEADS
        self.own = None if as_printed else nn.Linear(FEATURES, FEATURES, bias=False)
        self.bend = nn.Identity() if as_printed else nn.LeakyReLU(SLOPE)
        self.embed = nn.Embedding(GRID * GRID, FEATURES) if use_position else None
        self.transform = nn.Linear(FEATURES, FEATURES, bias=False)
        self.query = nn.Linear(FEATURES, FEATURES, bias=False)
        self.key = nn.Linear(FEATURES, FEATURES, bias=False)
        self.score = nn.Parameter(torch.empty(self.heads, FEATURES // self.heads))
        nn.init.xavier_uniform_(self.score)
        self.value = nn.Linear(FEATURES, FEATURES)
        self.slope = nn.LeakyReLU(SLOPE)

    def forward(self, features: Tensor, cells: Tensor, gains: Tensor, present: Tensor) -> Tensor:
        """Return h (B, F) of features (B, K, F), cells, gains, present (B, K)."""
        fused = self.transform(features)
        if self.embed is not None:
            fused = fused + self.embed(cells)
        fused = self.bend(fused)
        pairs = self.slope(self.query(fused[:, :1]) + self.key(fused)).unflatten(-1, (self.heads, -1))
        scores = (pairs * self.score).sum(-1)
        weights = torch.softmax(scores + FAR_BELOW * (1.0 - present).unsqueeze(-1), dim=1)
        if self.use_gain:
            weights = weights + gains.unsqueeze(-1)
        weights = weights * present.unsqueeze(-1)
        values = self.value(fused).unflatten(-1, (self.heads, -1))
        summed = (weights.unsqueeze(-1) * values).sum(dim=1).flatten(1)
        if self.own is not None:
            summed = summed + self.own(features[:, 0])
        return torch.relu(summed)


class Peer(nn.Module):
    """A layer of PyTorch Geometric over the star from the neighbours to the decider."""

    def __init__(self, layer: nn.Module, attends: bool) -> None:
        super().__init__()
        self.layer, self.attends = layer, attends

    def forward(self, features: Tensor, cells: Tensor, gains: Tensor, present: Tensor) -> Tensor:
        """Return h (B, F); ``cells`` and ``gains`` are not used."""
        batch, width = present.shape
        row, column = torch.nonzero(present[:, 1:] > 0.5, as_tuple=True)
        edges = torch.stack([row * width + column + 1, row * width])
        own = torch.arange(batch, device=features.device) * width
        if self.attends:
            edges = torch.cat([edges, torch.stack([own, own])], dim=1)  # attention includes the robot itself
        out: Tensor = self.layer(features.reshape(batch * width, -1), edges)
        return torch.relu(out[own])


class Alone(nn.Module):
    """The robot's own features through a layer as wide as the others'."""

    def __init__(self) -> None:
        super().__init__()
        self.linear = nn.Linear(FEATURES, FEATURES)

    def forward(self, features: Tensor, cells: Tensor, gains: Tensor, present: Tensor) -> Tensor:
        """Return h (B, F)."""
        return torch.relu(self.linear(features[:, 0]))


class Chooser(nn.Module):
    """Encoder, fusion and mapper."""

    def __init__(self, architecture: Architecture) -> None:
        super().__init__()
        self.architecture = architecture
        self.encoder = Encoder(tuple(architecture.channels), architecture.stem_stride)
        self.fusion = _fusion(architecture)
        self.mapper = nn.Sequential(
            nn.Dropout(architecture.dropout), nn.Linear(FEATURES, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, 2)
        )

    def decide(self, features: Tensor, cells: Tensor, gains: Tensor, present: Tensor) -> Tensor:
        """Return logits (B, 2) of features (B, K, F), cells (B, K) int64, gains and present (B, K)."""
        out: Tensor = self.mapper(self.fusion(features, cells, gains, present))
        return out


def _fusion(architecture: Architecture) -> nn.Module:
    if architecture.network == "giwt":
        return Giwt(architecture.use_gain, architecture.use_position, architecture.as_printed)
    if architecture.network == "cnn":
        return Alone()
    from torch_geometric.nn import GATConv, SAGEConv  # takes longer to import than all else: for its layers only

    if architecture.network == "gat":
        width = FEATURES // HEADS
        return Peer(GATConv(FEATURES, width, HEADS, negative_slope=SLOPE, add_self_loops=False, residual=True), True)
    return Peer(SAGEConv(FEATURES, FEATURES), False)

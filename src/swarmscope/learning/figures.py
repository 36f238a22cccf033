"""Pictures of what a network has learnt: layers by t-SNE (GIWT Fig. 5), accuracy against the radius seen (Fig. 6)."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import torch
from matplotlib.figure import Figure
from numpy.typing import NDArray

from swarmscope.errors import ConfigError
from swarmscope.learning.batches import make_batch
from swarmscope.learning.evaluate import Score, Trained
from swarmscope.learning.records import Shard
from swarmscope.learning.train import view_of

LAYERS = ("input", "encoder", "graph layer", "final layer")
LEFT, RIGHT = "#2166ac", "#b2182b"
POINTS, FEWEST = 2000, 200
DPI = 120


@torch.no_grad()
def layers(trained: Trained, data: Shard, seed: int = 0) -> tuple[dict[str, NDArray[np.float32]], NDArray[np.int64]]:
    """Return what every layer says of POINTS samples, (n, width) each, and their classes (n,): 0 left, 1 right."""
    rng = np.random.default_rng(seed)
    chosen = np.sort(rng.permutation(data.samples)[:POINTS])
    view = view_of(trained.config)
    batch = make_batch(data, chosen, np.zeros(len(chosen), np.bool_), np.full(len(chosen), view.seen_m), view)
    model = trained.model.eval().cpu()
    features = torch.cat([model.encoder(torch.from_numpy(part).float()) for part in np.array_split(batch.maps, 40)])
    slots, cells, gains, present = (torch.from_numpy(a) for a in (batch.slots, batch.cells, batch.gains, batch.present))
    nodes = features[slots] * present.unsqueeze(-1)
    fused = model.fusion(nodes, cells, gains, present)
    hidden = model.mapper[:-1](fused)
    own = batch.maps[batch.slots[:, 0]].reshape(len(chosen), -1).astype(np.float32)
    found = {"input": own, "encoder": nodes[:, 0].numpy(), "graph layer": fused.numpy(), "final layer": hidden.numpy()}
    return found, batch.right


def separation(points: NDArray[np.float32], classes: NDArray[np.int64]) -> float:
    """Return how often a point's five nearest neighbours are of its class by majority."""
    from sklearn.neighbors import KNeighborsClassifier

    nearest = KNeighborsClassifier(6).fit(points, classes).kneighbors(points, return_distance=False)[:, 1:]
    return float((np.abs(classes[nearest].mean(axis=1) - classes) < 0.5).mean())


def tsne_png(trained: Trained, data: Shard) -> bytes:
    """Return Fig. 5: each layer's outputs in the plane, blue for left, red for right."""
    from sklearn.decomposition import PCA
    from sklearn.manifold import TSNE

    if data.samples < FEWEST:
        raise ConfigError("--pictures", f"a picture of the layers needs {FEWEST} samples or more, not {data.samples}")
    found, classes = layers(trained, data)
    figure = Figure(figsize=(13, 3.7), layout="constrained")
    axes: Any = figure.subplots(1, len(LAYERS))
    for axis, name in zip(axes, LAYERS, strict=True):
        values = found[name]
        if values.shape[1] > 50:
            values = PCA(50, random_state=0).fit_transform(values)
        plane = TSNE(2, random_state=0, init="pca", perplexity=40).fit_transform(values)
        axis.scatter(*plane.T, s=3, c=np.where(classes == 0, LEFT, RIGHT), linewidths=0)
        axis.set_title(f"{name}\nfive nearest agree: {100 * separation(values, classes):.0f} %", fontsize=10)
        axis.set_xticks([])
        axis.set_yticks([])
    handles = [axes[0].plot([], [], "o", color=c, label=t)[0] for c, t in ((LEFT, "left"), (RIGHT, "right"))]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    return _png(figure)


def radius_png(scores: dict[str, dict[float, Score]]) -> bytes:
    """Return Fig. 6: accuracy of each network against the radius of its pictures [m], with intervals."""
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axis = figure.subplots()
    for label, of_radius in scores.items():
        radii = sorted(of_radius)
        values = np.array([of_radius[r][:3] for r in radii], float) * 100.0
        axis.plot(radii, values[:, 0], "o-", label=label)
        axis.fill_between(radii, values[:, 1], values[:, 2], alpha=0.15)
    axis.set_xlabel("perception radius [m]")
    axis.set_ylabel("accuracy [%]")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    return _png(figure)


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=DPI, metadata={"Software": None})
    return out.getvalue()

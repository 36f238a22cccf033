"""Writes the video of a run: GIF with Pillow, MP4 (H.264) with PyAV."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from swarmscope.errors import ConfigError, MissingExtraError
from swarmscope.viewing.run_data import load_run, replacing
from swarmscope.viewing.video.scene import Frame, Scene

NAME = "video.gif"
"""What the video is called in a run folder, unless it is told otherwise."""
SLOWEST, FASTEST = 0.01, 1000.0
SPEEDS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
USUAL_S = 30.0
"""Without a speed the slowest of these is taken with which the video is not longer."""
HOLD_S = 1.5
"""How long the end stands still."""
MOST_FRAMES = 9000
MOST_GIF_PIXELS = 600_000_000
"""Of all frames together: Pillow keeps them until the last one is drawn."""
PALETTE_FRAMES = 4


class Film(NamedTuple):
    """What a video is to be like."""

    speed: float | None = None
    """Seconds of the run in one of the video."""
    fps: int = 20
    size: int = 800
    """Longer side of the picture [pixels]."""
    scans: bool = True
    """Whether scans and safe directions are drawn."""
    close: bool = False
    """Whether only that is shown where the robots have been, instead of the whole world."""


USUAL = Film()


def check_film(path: Path, film: Film) -> None:
    """Raise a ConfigError or a MissingExtraError if there can be no such video."""
    if path.suffix.lower() not in (".gif", ".mp4"):
        raise ConfigError(str(path), "a video's name ends with .gif or .mp4")
    if not path.parent.is_dir():
        raise ConfigError(str(path.parent), "no such folder")
    if film.speed is not None and not SLOWEST <= film.speed <= FASTEST:
        raise ConfigError("--speed", f"must be from {SLOWEST:g} to {FASTEST:g}, not {film.speed!r}")
    if path.suffix.lower() == ".mp4" and find_spec("av") is None:
        raise MissingExtraError(f"{path}: an .mp4, unlike a .gif,", "video")


def write_video(
    run_dir: Path, path: Path, film: Film = USUAL, progress: Callable[[int, int], None] | None = None
) -> Path:
    """Write the video of a finished run and return its path; ``progress(frames, of)``."""
    check_film(path, film)
    run = load_run(run_dir)
    speed = film.speed or usual_speed(float(run.trajectory.t_s[-1] - run.trajectory.t_s[0]))
    scene = Scene(run, film.size, film.scans, speed, film.close)
    times = moments_of(scene.moments.begin_s, scene.moments.end_s, speed, film.fps)
    first = scene.frame(times[0])
    _check_size(path, len(times), first)
    frames = _counted((scene.frame(t) for t in times), len(times), progress)
    with replacing(path) as temporary:
        if path.suffix.lower() == ".gif":
            some = [scene.frame(t) for t in np.linspace(times[0], times[-1], PALETTE_FRAMES)]
            _write_gif(temporary, frames, len(times), film.fps, _palette(some))
        else:
            _write_mp4(temporary, frames, film.fps, first.shape)
    return path


def usual_speed(length_s: float) -> float:
    """Return the speed at which a run of ``length_s`` is shown if nobody gives one."""
    return next((speed for speed in SPEEDS if length_s / speed <= USUAL_S), SPEEDS[-1])


def moments_of(begin_s: float, end_s: float, speed: float, fps: int) -> list[float]:
    """Return the moment of the run that each frame shows; the end is shown for ``HOLD_S``."""
    steps = math.ceil((end_s - begin_s) * fps / speed - 1e-9)
    moving = [begin_s + k * speed / fps for k in range(min(steps, MOST_FRAMES + 1))]
    return [*moving, *[end_s] * max(1, round(HOLD_S * fps))]


def _check_size(path: Path, frames: int, first: Frame) -> None:
    if frames > MOST_FRAMES:
        remedy = "give a higher --speed or a lower --fps"
        raise ConfigError(str(path), f"would have more than {MOST_FRAMES} frames: {remedy}")
    if path.suffix.lower() == ".gif" and frames * first.shape[0] * first.shape[1] > MOST_GIF_PIXELS:
        raise ConfigError(str(path), "is too much for a .gif: a higher --speed, a lower --fps or --size, or an .mp4")


def _counted(frames: Iterator[Frame], total: int, progress: Callable[[int, int], None] | None) -> Iterator[Frame]:
    for number, frame in enumerate(frames, start=1):
        yield frame
        if progress is not None:
            progress(number, total)


def _palette(frames: list[Frame]) -> Image.Image:
    """Return the colours that all frames share: those that are frequent, and those that are far from all others."""
    picture, colours = Image.fromarray(np.concatenate(frames)), []
    for count, method in ((128, Image.Quantize.MEDIANCUT), (127, Image.Quantize.MAXCOVERAGE)):
        colours += (picture.quantize(count, method=method).getpalette() or [])[: 3 * count]
    shared = Image.new("P", (1, 1))
    shared.putpalette(colours)
    return shared


def _write_gif(path: Path, frames: Iterator[Frame], total: int, fps: int, palette: Image.Image) -> None:
    pictures = (Image.fromarray(f).quantize(palette=palette, dither=Image.Dither.NONE) for f in frames)
    first = next(pictures)
    shown = durations(fps, total)
    first.save(path, "GIF", save_all=True, append_images=pictures, duration=shown, loop=0, optimize=True)


def durations(fps: int, frames: int) -> list[int]:
    """Return how long each frame is shown [ms]: GIFs count hundredths of a second, and must not lag behind in sum."""
    edges = [round(100.0 * k / fps) for k in range(frames + 1)]
    return [10 * (b - a) for a, b in pairwise(edges)]


def _write_mp4(path: Path, frames: Iterator[Frame], fps: int, shape: tuple[int, ...]) -> None:
    import av

    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=Fraction(fps), options={"crf": "20", "preset": "medium"})
        stream.height, stream.width, stream.pix_fmt = shape[0], shape[1], "yuv420p"
        for frame in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        container.mux(stream.encode())

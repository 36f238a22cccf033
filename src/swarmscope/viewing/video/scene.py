"""Draws a run at a moment: what stands still once, what moves for every frame."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from swarmscope.lettering import drawing
from swarmscope.viewing.colours import CRASH, GROUND, INK, MOVER, SAFE, WALL, robot_colours
from swarmscope.viewing.pictures import MOST_NUMBERS, draw_frame, draw_obstacles, extent_of
from swarmscope.viewing.run_data import RunData, discs_of, doors_of, headline
from swarmscope.viewing.video.moments import Moments, Poses

Frame = npt.NDArray[np.uint8]
DPI = 100
LEAST_RADIUS_PX = 4.0
"""Robots are drawn at least this large."""
LINK_S = 0.6
"""How long a packet stays visible, seconds of the video."""
LEFT, RIGHT, BELOW, ABOVE = 54, 14, 62, 36
"""What is left free round the world [pixels], for scales and words."""
NARROWEST = 420
"""The words need so much [pixels]."""


class Scene:
    """The world of a run on ``size`` pixels, its longer side; ``close``: where the robots have been."""

    def __init__(self, run: RunData, size: int, scans: bool, speed: float, close: bool = False) -> None:
        self._run, self._scans, self._speed = run, scans, speed
        self.moments = Moments(run)
        with drawing():
            self._build(size, close)

    def frame(self, t_s: float) -> Frame:
        """Return the picture of a moment, (H, W, 3)."""
        self._canvas.restore_region(self._still)
        self._place(t_s)
        for artist in self._moving:
            artist.draw(self._canvas.get_renderer())
        picture: Frame = np.asarray(self._canvas.buffer_rgba())[..., :3].copy()
        return picture

    def _build(self, size: int, close: bool) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        x0, y0, x1, y1 = extent = extent_of(self._run, close)
        scale = min((size - LEFT - RIGHT) / (x1 - x0), (size - BELOW - ABOVE) / (y1 - y0))
        wanted = max((x1 - x0) * scale + LEFT + RIGHT, NARROWEST), (y1 - y0) * scale + BELOW + ABOVE
        width, height = (2 * round(0.5 * length) for length in wanted)  # H.264 takes even lengths only
        figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
        canvas: Any = FigureCanvasAgg
        self._canvas = canvas(figure)
        box = (LEFT / width, BELOW / height, 1.0 - (LEFT + RIGHT) / width, 1.0 - (BELOW + ABOVE) / height)
        axes = figure.add_axes(box)
        draw_frame(axes, extent)
        draw_obstacles(axes, self._run.world.obstacles)
        axes.set_title(headline(self._run), loc="left", fontsize=10, color=INK, pad=7, fontweight="bold")
        self._colours = robot_colours(len(self._run.world.robots))
        self._radii = np.array([max(robot.radius, LEAST_RADIUS_PX / scale) for robot in self._run.world.robots])
        self._radii_pt = self._radii * scale * 72 / DPI
        goals = np.array([robot.goal for robot in self._run.world.robots])
        wide = (2.8 * self._radii_pt) ** 2
        axes.scatter(goals[:, 0], goals[:, 1], s=wide, facecolor="none", edgecolor=self._colours)
        self._make_moving(axes, figure)
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(figure.bbox)

    def _make_moving(self, axes: Any, figure: Any) -> None:
        """Make the artists that are drawn anew for every frame, in the order in which they cover one another."""
        from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection

        n, wide = len(self._colours), 2.0 * self._radii
        self._fans = axes.add_collection(PolyCollection([], facecolor=SAFE, lw=0, alpha=0.13))
        broad = [2.0 * disc.radius for disc in discs_of(self._run.world)]
        self._discs = axes.add_collection(
            EllipseCollection(
                broad, broad, [0.0] * len(broad), units="xy", offset_transform=axes.transData, lw=0.8, facecolor=MOVER
            )
        )
        self._doors = axes.add_collection(LineCollection([], colors=WALL, lw=2.2))
        (self._returns,) = axes.plot([], [], ls="none", marker="s", ms=1.1, mew=0, color=INK, alpha=0.55)
        self._paths = axes.add_collection(LineCollection([], colors=self._colours, lw=1.3, alpha=0.85))
        self._links = axes.add_collection(LineCollection([], lw=1.3))
        self._bodies = axes.add_collection(
            EllipseCollection(wide, wide, np.zeros(n), units="xy", offset_transform=axes.transData, lw=1.4)
        )
        self._bodies.set_edgecolor(self._colours)
        self._headings = axes.add_collection(LineCollection([], colors="white", lw=1.6))
        (self._crashes,) = axes.plot([], [], ls="none", marker="X", ms=11, mfc=CRASH, mec="white")
        self._numbers = [self._number(axes, i) for i in range(n)] if n <= MOST_NUMBERS else []
        self._words = figure.text(LEFT / figure.bbox.width, 12 / figure.bbox.height, "", fontsize=9.5, color=INK)
        still = [self._discs, self._doors]
        still += [self._fans, self._returns, self._paths, self._links, self._bodies, self._headings, self._crashes]
        self._moving = [*still, *self._numbers, self._words]
        for artist in self._moving:
            artist.set_animated(True)

    def _number(self, axes: Any, robot: int) -> Any:
        from matplotlib.patheffects import withStroke

        words = {"fontsize": 7, "color": self._colours[robot], "annotation_clip": False}
        words["path_effects"] = [withStroke(linewidth=2.0, foreground=GROUND)]
        name, beside = str(self._run.world.robots[robot].id), 2.0 + 0.7 * float(self._radii_pt[robot])
        return axes.annotate(name, (0, 0), xytext=(beside, beside), textcoords="offset points", **words)

    def _place(self, t_s: float) -> None:
        """Move everything to where it is at a moment."""
        moments, poses = self.moments, self.moments.poses(t_s)
        spots = np.column_stack([poses.x, poses.y])
        self._discs.set_offsets(moments.discs(t_s))
        doors = zip(doors_of(self._run.world), moments.closed(t_s), strict=True)
        self._doors.set_segments([door.points for door, shut in doors if shut])
        if self._scans:
            self._fans.set_verts(moments.fans(t_s))
            self._returns.set_data(*moments.returns(t_s).T)
        self._paths.set_segments(self._ways(t_s, spots))
        self._place_links(t_s, spots)
        arrived, crashed = moments.arrived(t_s), moments.crashed(t_s)
        self._bodies.set_offsets(spots)
        self._bodies.set_facecolor(np.where(arrived[:, None], (1.0, 1.0, 1.0, 1.0), self._colours))
        self._headings.set_segments(self._noses(poses)[~arrived])
        self._crashes.set_data(*spots[crashed].T)
        for number, spot in zip(self._numbers, spots, strict=False):
            number.xy = spot
        self._words.set_text(self._status(t_s, int(arrived.sum()), int(crashed.sum())))

    def _ways(self, t_s: float, spots: Any) -> Any:
        of, k = self._run.trajectory, self.moments.tick(t_s)
        so_far = np.stack([of.x_m[: k + 1].T, of.y_m[: k + 1].T], axis=2)
        return np.concatenate([so_far, spots[:, None]], axis=1)

    def _noses(self, poses: Poses) -> Any:
        """Return a line on each body that shows where it looks."""
        spots = np.column_stack([poses.x, poses.y])
        ahead = self._radii[:, None] * np.column_stack([np.cos(poses.yaw), np.sin(poses.yaw)])
        return np.stack([spots + 0.1 * ahead, spots + 0.9 * ahead], axis=1)

    def _place_links(self, t_s: float, spots: Any) -> None:
        pairs, age = self.moments.links(t_s, LINK_S * max(1.0, self._speed))
        colours = self._colours[pairs[:, 0]] if len(pairs) else np.zeros((0, 4))
        colours[:, 3] = 1.0 - age**2
        self._links.set_segments(spots[pairs])
        self._links.set_color(colours)

    def _status(self, t_s: float, arrived: int, crashed: int) -> str:
        many = len(self._colours)
        words = [f"{t_s:6.1f} s", f"{arrived} of {many} arrived"]
        words += [f"{crashed} collided"] if crashed else []
        return "     ".join([*words, f"{self._speed:g}×"])

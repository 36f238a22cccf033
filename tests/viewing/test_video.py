"""Videos of runs, decoded again; the moments that they show."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fake_run import RANGE_MAX, make_fake_run
from PIL import Image

from swarmscope.errors import ConfigError, MissingExtraError, SwarmscopeError
from swarmscope.viewing.run_data import RunData, load_run, replace_file
from swarmscope.viewing.video import write
from swarmscope.viewing.video.moments import Moments
from swarmscope.viewing.video.scene import Scene
from swarmscope.viewing.video.write import Film, moments_of, write_video

CRASH = (0xC2, 0x3B, 0x22)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four robots, 12 ticks of 0.4 s; number 2 collides in the sixth."""
    return make_fake_run(tmp_path_factory.mktemp("video") / "run", robots=4, ticks=12, beams=36, crashed=2)


def changed(run: RunData, **arrays: np.ndarray) -> Moments:
    return Moments(RunData(run.folder, run.world, run.trajectory._replace(**arrays), run.metrics))


def test_poses_lie_between_the_ticks_and_turn_the_short_way(folder: Path) -> None:
    run = load_run(folder)
    x, yaw = run.trajectory.x_m.copy(), run.trajectory.yaw_rad.copy()
    x[:2, 0], yaw[:2, 0] = (1.0, 2.0), (3.0, -3.0)
    moments = changed(run, x_m=x, yaw_rad=yaw)
    poses = moments.poses(0.1)
    assert poses.x[0] == pytest.approx(1.25)
    assert poses.yaw[0] == pytest.approx(3.0 + 0.25 * (2 * math.pi - 6.0))
    assert moments.poses(4.4).x[1] == run.trajectory.x_m[-1, 1]
    assert [moments.tick(t) for t in (0.0, 0.39, 0.4, 99.0)] == [0, 0, 1, 11]


def test_who_has_arrived_and_collided(folder: Path) -> None:
    run = load_run(folder)
    moments = changed(run, arrival_s=np.array([2.0, np.nan, np.nan, 4.6]))
    assert moments.arrived(1.9).tolist() == [False] * 4
    assert moments.arrived(2.0).tolist() == [True, False, False, False]
    assert moments.arrived(4.4).tolist() == [True, False, False, True]  # with the last tick
    assert moments.crashed(2.3).tolist() == [False] * 4 and moments.crashed(2.4).tolist() == [False, False, True, False]


def test_packets_fade(folder: Path) -> None:
    moments = changed(load_run(folder), links=np.array([[5, 1, 0, 20], [2, 3, 1, 24], [5, 0, 1, 20]]))
    pairs, age = moments.links(2.2, 0.5)
    assert pairs.tolist() == [[1, 0], [0, 1]] and age == pytest.approx([0.4, 0.4])
    assert moments.links(0.9, 0.5)[0].tolist() == [[3, 1]] and len(moments.links(1.31, 0.5)[0]) == 0


def test_returns_and_safe_directions_lie_round_the_robots_under_way(folder: Path) -> None:
    """One return at half of the range straight ahead; the four beams from there on are safe."""
    run = load_run(folder)
    of, ahead = run.trajectory, 18
    scan, safe = np.full_like(of.scan_u8, 255), np.zeros((12, 4, 36), np.uint8)
    scan[5, :, ahead], safe[5, :, ahead : ahead + 4] = 127, 1
    bits = np.packbits(safe, axis=2)
    moments = changed(run, scan_u8=scan, safe_bits=bits, arrival_s=np.array([0.4, np.nan, np.nan, np.nan]))
    points = moments.returns(2.0)
    assert len(points) == 3  # not of the one that has arrived
    x, y, yaw = of.x_m[5, 1], of.y_m[5, 1], of.yaw_rad[5, 1]
    assert points[0] == pytest.approx((x + 0.5 * RANGE_MAX * math.cos(yaw), y + 0.5 * RANGE_MAX * math.sin(yaw)))
    fan = moments.fans(2.0)[0]
    assert fan[0] == pytest.approx((x, y))
    angles = np.degrees(np.arctan2(*(fan[1:] - fan[0]).T[::-1])) - math.degrees(yaw)
    assert (angles.min(), angles.max()) == pytest.approx((-5.0, 35.0))
    assert np.hypot(*(fan[1:] - fan[0]).T) == pytest.approx(6 * 0.15)


def test_frames_show_who_collided_where_it_is(folder: Path) -> None:
    run = load_run(folder)
    scene = Scene(run, 300, True, 1.0)
    before, after = scene.frame(0.0), scene.frame(4.4)
    assert before.shape[1] % 2 == before.shape[0] % 2 == 0 and max(before.shape) == 420
    assert not (before == CRASH).all(axis=2).any()
    row, column = (np.median(k) for k in np.nonzero((after == CRASH).all(axis=2)))
    spot = scene._bodies.axes.transData.transform((run.trajectory.x_m[-1, 2], run.trajectory.y_m[-1, 2]))
    assert (column, after.shape[0] - row) == pytest.approx(spot, abs=2.0)
    assert np.array_equal(scene.frame(0.0), before)


def test_gif_plays_as_long_as_it_should(folder: Path, tmp_path: Path) -> None:
    """4.4 s at double speed are 2.2 s, and the end stands still for 1.5 s; GIFs count hundredths of a second."""
    seen: list[tuple[int, int]] = []
    film = Film(speed=2.0, fps=15, size=300)
    path = write_video(folder, tmp_path / "a.gif", film, lambda done, total: seen.append((done, total)))
    with Image.open(path) as picture:
        shown = []
        for k in range(picture.n_frames):
            picture.seek(k)
            shown.append(picture.info["duration"])
        assert sum(shown) == pytest.approx(1000 * (33 + 22) / 15, abs=10)
        assert set(shown[:-1]) <= {60, 70} and picture.info["loop"] == 0
        colours = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(int)
    assert (np.abs(colours - CRASH).max(axis=1) < 12).sum() > 20
    assert seen[-1] == (55, 55)
    assert write_video(folder, tmp_path / "b.GIF", film).read_bytes() == path.read_bytes()


def test_mp4_plays_as_long_as_it_should(folder: Path, tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    path = write_video(folder, tmp_path / "a.mp4", Film(speed=4.0, fps=10, size=300))
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.average_rate, stream.frames) == ("h264", 10, 11 + 15)
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in container.decode(video=0)]
    drawn = Scene(load_run(folder), 300, True, 4.0).frame(4.4)
    assert frames[-1].shape == drawn.shape
    assert np.abs(frames[-1] - drawn).mean() < 6.0


def test_moments_of_the_frames_and_how_long_each_is_shown() -> None:
    assert moments_of(0.0, 1.0, 0.5, 4) == [*(0.125 * k for k in range(8)), *[1.0] * 6]
    assert write.durations(15, 3) == [70, 60, 70]
    assert [write.usual_speed(s) for s in (30.0, 30.1, 600.0, 86400.0)] == [1.0, 2.0, 32.0, 64.0]


def test_refused_videos(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, film, words in (
        ("a.avi", Film(), "ends with .gif or .mp4"),
        ("no/a.gif", Film(), "no such folder"),
        ("a.gif", Film(speed=0.0), "--speed: must be from 0.01 to 1000"),
        ("a.gif", Film(speed=math.nan), "--speed: must be from 0.01 to 1000"),
        ("a.gif", Film(speed=0.01, fps=50), "would have more than 9000 frames"),
        ("a.gif", Film(speed=0.05, fps=50, size=1000), "is too much for a .gif"),
    ):
        with pytest.raises(ConfigError, match=words.replace(".", r"\.")):
            write_video(folder, tmp_path / name, film)
    monkeypatch.setattr(write, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"a\.mp4: an \.mp4, unlike a \.gif, needs .*swarmscope\[video\]"):
        write_video(folder, tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_written_is_one_plain_error(tmp_path: Path) -> None:
    with pytest.raises(SwarmscopeError, match=r"paths\.png: cannot be written: No such file or directory"):
        replace_file(tmp_path / "gone/paths.png", b"")

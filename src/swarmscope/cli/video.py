"""``swarmscope video``."""

from __future__ import annotations

from pathlib import Path

from swarmscope.viewing.progress import steps_bar
from swarmscope.viewing.video.write import NAME, Film, write_video


def video_command(run_dir: Path, out: Path | None, film: Film) -> None:
    """Write the video of a run folder."""
    path = run_dir / NAME if out is None else out
    with steps_bar(path.name) as progress:
        print(write_video(run_dir, path, film, progress))

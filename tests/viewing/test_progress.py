"""How far a run is: one bar at a time."""

from __future__ import annotations

from swarmscope.viewing import progress
from swarmscope.viewing.progress import steps_bar


def test_one_bar_is_shown_at_a_time() -> None:
    """Writing a file within a run's bar takes its place: two at once are an error in older versions of rich."""
    with steps_bar("run", 0.0) as run:
        run(1, 2)
        (first,) = progress._shown
        with steps_bar("file", 0.0) as file:
            file(3, 4)
            (second,) = progress._shown
            assert second is not first and second.live.is_started and not first.live.is_started
            assert (second.tasks[0].completed, second.tasks[0].total) == (3, 4)
            assert second.tasks[0].fields["note"] == "3 of 4"
        assert not progress._shown and not second.live.is_started
        run(2, 2)
        assert progress._shown == [first]
    assert not progress._shown and not first.live.is_started


def test_what_is_quick_shows_nothing() -> None:
    with steps_bar("file", 60.0) as file:
        file(1, 2)
        assert not progress._shown

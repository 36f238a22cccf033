"""Whose packets are new: what is remembered of each sender, so that replays fail and those who restart are heard.

Of each sender two windows (``window``) are kept, each of one boot number: what it sends now, and what it sent before it
restarted or before its counter leapt. A packet that continues neither is on probation: it opens a window when another
one follows it, or when nothing else of that sender has come for ``QUIET_S``. So one packet with a forged number
moves nothing, and after two the true sender still goes on in its own window. Answers need no window: they name
our present request and are taken once, which no replay can; they show what their sender's present numbers are.
What a forger can do all the same: docs/message.md.
"""

from __future__ import annotations

import numpy as np

from swarmscope._jit import jit_inline, jit_inner
from swarmscope.onboard.percept import NEVER_S, PEERS, SENDERS, Row
from swarmscope.onboard.sharing.window import CLOSED, OPEN, WINDOW, Seen, ahead_by, is_near, is_seen, with_seen
from swarmscope.onboard.view import View

QUIET_S = 1.0
"""After so long without a packet of a sender, one that continues nothing is taken at once [s]."""
FORGET_S = 30.0
"""A window without a packet for so long gives way to a new one, however much came in it [s]."""
SURE = 64
"""An answer to our present request counts as many packets when it is decided which window stays."""
MOST = 30_000
"""Packets of a window are counted up to here."""
SECOND = 1.0 - 1e-6
"""A second, so that ten ticks of 0.1 s are one [s]."""
ANSWERS_PER_S = 5
"""Requests of one sender that are answered in a second."""
STRANGERS_PER_S = 16
"""Requests of all together that are not in sight: addresses can be made up, and an answer is longer than a request."""


@jit_inline
def take_request(see: View, header: np.ndarray) -> int:
    """Return the slot of the sender of a request (``header`` as ``decode`` fills it in), -1 if it is no new one."""
    shared, now = see.shared, see.percept["now_s"]
    boot, seq = int(header[5]), int(header[2])
    p = _slot_of(shared, int(header[1]))
    near, behind, same = 0, 0, 0
    for w in range(2):
        if shared["window_boot"][p, w] != boot:
            continue
        same += 1
        ahead = ahead_by(seq, shared["window_seq"][p, w])
        if is_near(ahead):
            if is_seen(shared["window_seen"][p, w], ahead):
                return -1
            near += 1
        elif ahead < 0:
            behind += 1
    if near > 0:
        _note(see, p, header, 1)
        return p
    if same > 0 and behind == same:
        return -1
    quiet = now - max(shared["window_s"][p, 0], shared["window_s"][p, 1]) >= QUIET_S
    follows = shared["trial_boot"][p] == boot and 0 < ahead_by(seq, shared["trial_seq"][p]) <= WINDOW
    if quiet or follows:
        _open(see, p, header, OPEN)
        return p
    shared["trial_boot"][p], shared["trial_seq"][p] = boot, seq
    return -1


@jit_inline
def note_answer(see: View, header: np.ndarray) -> None:
    """Take the numbers of an answer to our present request for those that its sender has now, whatever came before."""
    shared = see.shared
    p = _slot_of(shared, int(header[1]))
    same = False
    for w in range(2):
        if shared["window_boot"][p, w] == header[5]:
            same = True
            if is_near(ahead_by(header[2], shared["window_seq"][p, w])):
                _note(see, p, header, SURE)
                return
    _open(see, p, header, CLOSED if same else OPEN)
    _note(see, p, header, SURE)


@jit_inline
def may_answer(see: View, p: int) -> bool:
    """Tell whether the sender in slot ``p`` gets one more answer in this second, and count it."""
    shared, now = see.shared, see.percept["now_s"]
    if now - shared["quota_s"] >= SECOND:
        shared["quota_s"], shared["strangers_n"] = now, 0
        for q in range(SENDERS):
            shared["quota_n"][q] = 0
    stranger = not _in_sight(shared, shared["sender_id"][p])
    if shared["quota_n"][p] >= ANSWERS_PER_S or (stranger and shared["strangers_n"] >= STRANGERS_PER_S):
        return False
    shared["quota_n"][p] += 1
    if stranger:
        shared["strangers_n"] += 1
    return True


@jit_inner
def _slot_of(shared: Row, sender: int) -> int:
    """Return the slot of ``sender``; a new one gets a free one, or that of whom nobody has heard for longest.

    Who is in sight keeps its slot: addresses can be made up, a body cannot.
    """
    free, oldest, oldest_s = -1, -1, 0.0
    for p in range(SENDERS):
        who = shared["sender_id"][p]
        if who == sender:
            return p
        if who < 0:
            free = p if free < 0 else free
    if free < 0:
        for p in range(SENDERS):
            heard_s = max(shared["window_s"][p, 0], shared["window_s"][p, 1])
            if (oldest < 0 or heard_s < oldest_s) and not _in_sight(shared, shared["sender_id"][p]):
                oldest, oldest_s = p, heard_s
        free = max(0, oldest)  # SENDERS > PEERS: somebody is out of sight
    shared["sender_id"][free] = sender
    shared["trial_boot"][free] = -1
    shared["quota_n"][free] = 0
    for w in range(2):
        shared["window_s"][free, w], shared["window_boot"][free, w], shared["window_n"][free, w] = NEVER_S, -1, 0
    return free


@jit_inner
def _in_sight(shared: Row, peer: int) -> bool:
    """Tell whether ``peer`` has a track."""
    found = False
    for t in range(PEERS):
        found = found or shared["track_id"][t] == peer
    return bool(found)


@jit_inner
def _note(see: View, p: int, header: np.ndarray, count: int) -> None:
    """Mark a packet in the windows that it belongs to, as ``count`` packets."""
    shared = see.shared
    for w in range(2):
        ahead = ahead_by(header[2], shared["window_seq"][p, w])
        if shared["window_boot"][p, w] != header[5] or not is_near(ahead):
            continue
        shared["window_seen"][p, w] = with_seen(shared["window_seen"][p, w], ahead)
        if ahead > 0:
            shared["window_seq"][p, w] = header[2]
        shared["window_s"][p, w] = see.percept["now_s"]
        shared["window_n"][p, w] = min(MOST, shared["window_n"][p, w] + count)


@jit_inner
def _open(see: View, p: int, header: np.ndarray, seen: Seen) -> None:
    """Open a window for a packet, in place of the one in which less came, or nothing for ``FORGET_S``."""
    shared, now = see.shared, see.percept["now_s"]
    first, second = shared["window_s"][p, 0], shared["window_s"][p, 1]
    more = shared["window_n"][p, 0] - shared["window_n"][p, 1]
    w = 0 if more < 0 or (more == 0 and first <= second) else 1
    other_s, own_s = (second, first) if w == 0 else (first, second)
    if own_s > other_s and now - other_s > FORGET_S:
        w = 1 - w
    shared["window_boot"][p, w], shared["window_seq"][p, w] = header[5], header[2]
    shared["window_seen"][p, w], shared["window_n"][p, w] = seen, 1
    shared["window_s"][p, w] = now
    shared["trial_boot"][p] = -1

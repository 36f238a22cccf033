"""Who goes which way and when: earliest arrival along a way among planned robots, and a search over ways and orders.

Time is counted in ticks of some steps. A way is a row of places; in one tick a robot goes to the next place or
waits. All robots move straight between two ticks, so that the check of a tick against another robot is exact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from swarmscope._jit import jit, jit_inner
from swarmscope.disk.contact import nearest_on_the_way
from swarmscope.disk.rules import Floats, Ints

NEVER = 1_000_000
"""Tick of arrival of who has no plan."""


class Case(NamedTuple):
    """One run, in ticks."""

    place: Floats
    """(n, ways, places, 2)."""
    used: Ints
    """(n, ways): places in use, increasing; 0 for no way."""
    apart: float
    """Least distance between two robots."""
    pace: float
    """Longest way in one tick."""
    least: int
    """Ticks that the longest of the shortest ways takes."""


class Plan(NamedTuple):
    """Where everybody is at each tick; who has arrived stays."""

    track: Floats
    """(n, ticks, 2)."""
    last: Ints
    """(n,): tick of arrival; 0 for who waits at its start because it has no plan yet, -1 for who is not there."""
    arrival: Ints
    """(n,): the same, NEVER for who has no plan."""


class Work(NamedTuple):
    """Room to work in."""

    reach: npt.NDArray[np.uint8]
    """(delays, places): how a place is reached with a delay: 0 not, 1 by going, 2 by waiting."""
    check: Ints
    """(n,)."""
    order: Ints
    """(n,)."""
    ways: Ints
    """(ways,)."""
    old_track: Floats
    old_last: Ints
    old_arrival: Ints
    random: npt.NDArray[np.uint64]
    """(1,): state of the random numbers."""


def room_for(case: Case, ticks: int) -> tuple[Plan, Work]:
    """Return an empty plan and room to work in."""
    n, ways, most = case.place.shape[:3]
    plan = Plan(np.zeros((n, ticks, 2)), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64))
    work = Work(
        reach=np.zeros((ticks, most), dtype=np.uint8),
        check=np.zeros(n, dtype=np.int64),
        order=np.zeros(n, dtype=np.int64),
        ways=np.zeros(ways, dtype=np.int64),
        old_track=np.zeros((n, ticks, 2)),
        old_last=np.zeros(n, dtype=np.int64),
        old_arrival=np.zeros(n, dtype=np.int64),
        random=np.ones(1, dtype=np.uint64),
    )
    return plan, work


@jit_inner
def _random(work: Work, below: int) -> int:
    """Return a random whole number from 0 to below - 1 (xorshift)."""
    x = work.random[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    work.random[0] = x
    return int((x >> np.uint64(11)) % np.uint64(below))


@jit
def free_from(case: Case, plan: Plan, robot: int, x: float, y: float) -> int:
    """Return the tick from which on one can stand at a place for ever, NEVER if somebody stands there."""
    result = 0
    for j in range(len(plan.last)):
        if j == robot or plan.last[j] < 0:
            continue
        t = plan.last[j]
        px, py = plan.track[j, t, 0] - x, plan.track[j, t, 1] - y
        if px * px + py * py <= case.apart * case.apart:
            return NEVER
        while t > result:
            qx, qy = plan.track[j, t, 0] - x, plan.track[j, t, 1] - y
            px, py = plan.track[j, t - 1, 0] - x, plan.track[j, t - 1, 1] - y
            if nearest_on_the_way(px, py, qx, qy) <= case.apart:
                result = t
                break
            t -= 1 + max(0, int((math.sqrt(px * px + py * py) - case.apart) / case.pace - 1e-6))
    return result


@jit_inner
def _free(
    case: Case, plan: Plan, work: Work, robot: int, t: int, soonest: int, ax: float, ay: float, bx: float, by: float
) -> int:
    """Return -1 if a robot cannot go from a to b in the tick that ends at t, else the next tick to look at."""
    if t < soonest:
        return soonest
    soonest = NEVER
    for j in range(len(plan.last)):
        if j == robot or plan.last[j] < 0:
            continue
        if work.check[j] <= t:
            before, now = min(t - 1, plan.last[j]), min(t, plan.last[j])
            px, py = ax - plan.track[j, before, 0], ay - plan.track[j, before, 1]
            qx, qy = bx - plan.track[j, now, 0], by - plan.track[j, now, 1]
            if nearest_on_the_way(px, py, qx, qy) <= case.apart:
                return -1
            # Going on, the two come nearer by at most two paces a tick; the third is for a wait before that.
            gap = math.sqrt(qx * qx + qy * qy) - case.apart
            work.check[j] = t + 1 + max(0, int((gap - case.pace) / (2.0 * case.pace) - 1e-6))
        soonest = min(soonest, work.check[j])
    return soonest


@jit
def least_delay(case: Case, plan: Plan, work: Work, robot: int, way: int, most: int) -> int:
    """Return the least delay [ticks, up to ``most``] with which a robot gets along a way, -1 if there is none.

    Row d of ``work.reach`` says for each place whether one can be there d ticks later than at full speed.
    """
    count = case.used[robot, way]
    place = case.place[robot, way]
    stay = free_from(case, plan, robot, place[count - 1, 0], place[count - 1, 1])
    most = min(most, len(work.reach) - 1, plan.track.shape[1] - count)
    if stay > count - 1 + most:
        return -1
    for d in range(most + 1):
        soonest = 0
        for j in range(len(work.check)):
            work.check[j] = 0
        some = False
        for k in range(count):
            how = 1 if k == 0 and d == 0 else 0
            if k > 0 and work.reach[d, k - 1] > 0:
                result = _free(
                    case, plan, work, robot, k + d, soonest, place[k - 1, 0], place[k - 1, 1], place[k, 0], place[k, 1]
                )
                if result >= 0:
                    how, soonest = 1, result
            if how == 0 and d > 0 and work.reach[d - 1, k] > 0:
                result = _free(
                    case, plan, work, robot, k + d, soonest, place[k, 0], place[k, 1], place[k, 0], place[k, 1]
                )
                if result >= 0:
                    how, soonest = 2, result
            work.reach[d, k] = how
            some = some or how > 0
        if work.reach[d, count - 1] > 0 and count - 1 + d >= stay:
            return d
        if not some:
            return -1
    return -1


@jit
def write_track(case: Case, plan: Plan, work: Work, robot: int, way: int, delay: int) -> None:
    """Note the way just found by ``least_delay`` as the plan of a robot."""
    k, d = case.used[robot, way] - 1, delay
    plan.last[robot] = plan.arrival[robot] = k + d
    while True:
        plan.track[robot, k + d, 0] = case.place[robot, way, k, 0]
        plan.track[robot, k + d, 1] = case.place[robot, way, k, 1]
        if k + d == 0:
            return
        if work.reach[d, k] == 2:
            d -= 1
        else:
            k -= 1


@jit
def forget(case: Case, plan: Plan, robot: int) -> None:
    """Put a robot back to its start, where it waits."""
    plan.track[robot, 0, 0], plan.track[robot, 0, 1] = case.place[robot, 0, 0, 0], case.place[robot, 0, 0, 1]
    plan.last[robot], plan.arrival[robot] = 0, NEVER


@jit
def replan(case: Case, plan: Plan, work: Work, robot: int, target: int, cap: int, shuffled: bool) -> bool:
    """Give a robot the plan that arrives first, or any by ``target``; shorter ways are tried first unless shuffled.

    Returns whether there is one that arrives by ``cap``.
    """
    ways = 0
    while ways < case.used.shape[1] and case.used[robot, ways] > 0:
        work.ways[ways] = ways
        ways += 1
    if shuffled:
        for k in range(ways - 1, 0, -1):
            other = _random(work, k + 1)
            work.ways[k], work.ways[other] = work.ways[other], work.ways[k]
    best = cap + 1
    # First what arrives in time, then, if nothing does, what arrives first.
    for late in range(2):
        for k in range(ways):
            way = work.ways[k] if late == 0 else k
            full = case.used[robot, way] - 1
            most = (target if late == 0 else best - 1) - full
            if most < 0:
                continue
            delay = least_delay(case, plan, work, robot, way, most)
            if delay >= 0:
                best = full + delay
                write_track(case, plan, work, robot, way, delay)
                if late == 0:
                    return True
    return best <= cap


@jit
def _cost(case: Case, plan: Plan) -> int:
    """Return what the search makes small: the last arrival first, then the sum of all that is late."""
    worst = total = 0
    for i in range(len(plan.arrival)):
        late = min(NEVER, max(0, plan.arrival[i] - case.least))
        worst = max(worst, late)
        total += late
    return worst * 4_000_000 + min(total, 3_999_999)


@jit
def search(case: Case, plan: Plan, work: Work, order: Ints, iterations: int, seed: int) -> None:
    """Plan all robots in an order, then improve the plan."""
    n = len(order)
    work.random[0] = np.uint64(seed * 7919 + 88172645463325252)
    for i in range(n):
        forget(case, plan, i)
    for i in order:
        replan(case, plan, work, i, 0, NEVER - 1, False)
    cost = _cost(case, plan)
    for _ in range(iterations):
        if cost == 0:
            break
        cost = _improve(case, plan, work, cost)


@jit
def _improve(case: Case, plan: Plan, work: Work, cost: int) -> int:
    """Plan a late robot and some others anew; keep that if it is not worse. Return the cost."""
    cap = 0
    for i in range(len(plan.arrival)):
        cap = max(cap, plan.arrival[i])
    cap = min(cap, NEVER - 1)
    taken = _neighbours(case, plan, work, _some_late(case, plan, work))
    _keep(plan, work, taken)
    # Who waits for its plan stands in the way of others for ever, or, as there is a plan to go back to, not at all.
    ghosts = _random(work, 2) == 0
    for k in range(taken):
        forget(case, plan, work.order[k])
        if ghosts:
            plan.last[work.order[k]] = -1
    if _random(work, 3) == 0:
        other = _random(work, taken)
        work.order[0], work.order[other] = work.order[other], work.order[0]
    shuffled = _random(work, 4) > 0
    good = True
    for k in range(taken):
        good = good and replan(case, plan, work, work.order[k], case.least, cap, shuffled)
    if good:
        found = _cost(case, plan)
        if found <= cost:
            return found
    _put_back(plan, work, taken)
    return cost


@jit
def _some_late(case: Case, plan: Plan, work: Work) -> int:
    """Return a random one of the robots that are late."""
    late = 0
    for i in range(len(plan.last)):
        late += plan.arrival[i] > case.least
    chosen = _random(work, late)
    first = 0
    for i in range(len(plan.last)):
        if plan.arrival[i] > case.least:
            if chosen == 0:
                first = i
            chosen -= 1
    return first


@jit
def _keep(plan: Plan, work: Work, taken: int) -> None:
    """Note the plans of the first ``taken`` robots of ``work.order``."""
    for k in range(taken):
        i = work.order[k]
        work.old_last[i], work.old_arrival[i] = plan.last[i], plan.arrival[i]
        for t in range(plan.last[i] + 1):
            work.old_track[i, t, 0], work.old_track[i, t, 1] = plan.track[i, t, 0], plan.track[i, t, 1]


@jit
def _put_back(plan: Plan, work: Work, taken: int) -> None:
    """Give the first ``taken`` robots of ``work.order`` the plans that were noted."""
    for k in range(taken):
        i = work.order[k]
        plan.last[i], plan.arrival[i] = work.old_last[i], work.old_arrival[i]
        for t in range(plan.last[i] + 1):
            plan.track[i, t, 0], plan.track[i, t, 1] = work.old_track[i, t, 0], work.old_track[i, t, 1]


@jit
def _neighbours(case: Case, plan: Plan, work: Work, first: int) -> int:
    """Write a robot and others that are planned anew with it into ``work.order``; return how many.

    Half the time whoever is in its way on one of its short ways at full speed, else any.
    """
    n = len(plan.last)
    for i in range(n):
        work.order[i] = i
    work.order[0], work.order[first] = first, 0
    taken = 1
    if _random(work, 2) == 0:
        ways = 0
        while ways < min(8, case.used.shape[1]) and case.used[first, ways] > 0:
            ways += 1
        way = _random(work, max(1, ways))
        for k in range(1, n):
            if ways > 0 and _meets(case, plan, first, way, work.order[k]):
                work.order[taken], work.order[k] = work.order[k], work.order[taken]
                taken += 1
    most = min(n - taken, 4 if taken == 1 else 1)
    more = _random(work, most + 1)
    for k in range(taken, taken + more):
        other = k + _random(work, n - k)
        work.order[k], work.order[other] = work.order[other], work.order[k]
    taken += more
    for k in range(taken - 1, 1, -1):
        other = 1 + _random(work, k)
        work.order[k], work.order[other] = work.order[other], work.order[k]
    return taken


@jit
def _meets(case: Case, plan: Plan, robot: int, way: int, other: int) -> bool:
    """Return whether a robot at full speed on one of its ways would touch another."""
    place, last = case.place[robot, way], plan.last[other]
    t = 1
    while t < case.used[robot, way]:
        qx = place[t, 0] - plan.track[other, min(t, last), 0]
        qy = place[t, 1] - plan.track[other, min(t, last), 1]
        px = place[t - 1, 0] - plan.track[other, min(t - 1, last), 0]
        py = place[t - 1, 1] - plan.track[other, min(t - 1, last), 1]
        if nearest_on_the_way(px, py, qx, qy) <= case.apart:
            return True
        t += 1 + max(0, int((math.sqrt(qx * qx + qy * qy) - case.apart) / (2.0 * case.pace) - 1e-6))
    return False

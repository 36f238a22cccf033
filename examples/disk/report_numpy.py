"""The controller of the unit-disk report in plain NumPy, one robot after the other, as one would write it first.

swarmscope disk run examples/disk/report_numpy.py --map minima --permutation 0,1,2,4,3
"""

import numpy as np

OBSTACLE_BUFFER, ROBOT_BUFFER = 0.01, 0.02


def compute_gradients(state, targets, obstacles, r):
    """Return the velocities of all robots, each of length 1: unit-disk report, equations (1) to (3)."""
    centres = np.array([obstacle["center"] for obstacle in obstacles]).reshape(-1, 2)
    radii = np.array([obstacle["radius"] for obstacle in obstacles])
    velocity = np.empty_like(state)
    for i, robot in enumerate(state):
        others = np.delete(state, i, axis=0)
        to_goal = targets[i] - robot
        push_of_discs, near_disc = _repulsion(robot - centres, radii + r, OBSTACLE_BUFFER)
        push_of_robots, near_robot = _repulsion(robot - others, np.full(len(others), 2 * r), ROBOT_BUFFER)
        v = to_goal + push_of_discs + push_of_robots
        if near_disc or near_robot:
            ahead = near_disc and np.any((centres - robot) @ to_goal > 0.05)
            ahead = ahead or (near_robot and np.any((others - robot) @ to_goal > 0.05))
            v = np.array([-v[1], v[0]]) if ahead else to_goal + v / np.linalg.norm(v)
        velocity[i] = v
    return velocity / (np.linalg.norm(velocity, axis=1, keepdims=True) + 1e-12)


def _repulsion(away, reach, buffer):
    """Return the sum of the pushes by things at ``-away``, and whether any is nearer than ``buffer``."""
    distance = np.linalg.norm(away, axis=1)
    gap = distance - reach
    near = gap <= buffer
    push = 1.0 / (distance[near] * np.maximum(gap[near], 1e-5) ** 3)
    return push @ away[near], bool(near.any())

"""A robot's own map: what it has seen closed, in the frame of its odometry and compass, and ways through it."""

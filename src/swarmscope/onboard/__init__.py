"""What runs on the robot: numpy and numba only, no simulator."""

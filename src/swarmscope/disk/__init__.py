"""Many discs crossing a unit disk: the rules of the unit-disk report, its maps, and controllers that obey them.

Everything here is independent of the LiDAR simulator: positions are known exactly, robots are points with a
velocity, and a run is a long row of tiny steps. Lengths are in radii of the workspace.
"""

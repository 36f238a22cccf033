"""Maps from files: ROS map_server / nav2 (YAML and picture), a picture alone, the Moving AI benchmarks.

A map file becomes a `Grid`. Cells that the map marks unknown are solid: nobody measured them to be free.
"""

from swarmscope.sim.maps.map_server import closed, load_map, save_map
from swarmscope.sim.maps.movingai import Trip, load_movingai, load_trips
from swarmscope.sim.maps.packaged import packaged_map

__all__ = ["Trip", "closed", "load_map", "load_movingai", "load_trips", "packaged_map", "save_map"]

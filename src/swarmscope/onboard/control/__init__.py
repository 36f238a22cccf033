"""From a wanted direction to a velocity that is safe."""

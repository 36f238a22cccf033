"""The world, its sensors, radio and motion."""

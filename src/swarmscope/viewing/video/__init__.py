"""A run as a video, GIF or MP4."""

"""Pictures and the replay page, made from a run folder."""

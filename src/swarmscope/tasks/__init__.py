"""Seeded makers of worlds, starts and goals: one file each, found by scanning this folder."""

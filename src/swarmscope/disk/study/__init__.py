"""Runs of the unit disk in bulk, their figures, tables, pictures and replay pages."""

"""Pictures and pages of the unit disk."""

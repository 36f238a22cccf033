"""Reference paths, metrics, statistics and run folders."""

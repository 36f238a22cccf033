"""What decides a result: the run with its references, metrics, statistics, the run folder and where it comes from."""

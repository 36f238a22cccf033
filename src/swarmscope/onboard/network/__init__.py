"""GIWT's network on board: the picture of a scan, the graph of neighbours, the model, and how robots answer."""

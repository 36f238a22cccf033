"""What runs scenarios in bulk and keeps what came out: seeds, units of work, the store, engines, campaigns."""

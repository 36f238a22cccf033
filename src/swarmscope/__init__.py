"""swarmscope: swarm robots that share what they see."""

__version__ = "0.1.0"

"""``python -m swarmscope``."""

from swarmscope.cli.main import main

if __name__ == "__main__":
    main()

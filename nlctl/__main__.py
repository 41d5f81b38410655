"""``python -m nlctl`` and the console script: the command line of `nlctl.analysis`."""

from importlib import import_module


def main() -> None:
    """Run the command line, which stands on top of everything else."""
    import_module("nlctl.analysis.cli.main").main()


if __name__ == "__main__":
    main()

"""The version of nlctl, for the package, its wheel and the command line."""

__version__ = "0.1.0"

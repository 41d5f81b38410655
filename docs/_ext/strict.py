"""Warnings in executed pages are errors: a run that fell back to Python is not shown in silence."""

import warnings


def warnings_are_errors(gallery_conf, script):
    """Set the filter anew before each script."""
    from nlctl import EngineWarning

    warnings.simplefilter("error", EngineWarning)

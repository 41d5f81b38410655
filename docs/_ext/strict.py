"""How scripts of executed pages begin: warnings of the engine are errors, labels fit into figures."""

import warnings


def warnings_are_errors(gallery_conf, script):
    """Set the filter again before each script."""
    from nlctl.errors import EngineWarning

    warnings.simplefilter("error", EngineWarning)


def labels_fit(gallery_conf, script):
    """Lay figures out so that nothing is cut off at their edges."""
    import matplotlib as mpl

    mpl.rcParams["figure.constrained_layout.use"] = True

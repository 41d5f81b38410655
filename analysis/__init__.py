"""Analysis of closed loops: metrics, figures, reports.

The folder lies at the top of the repository, and is installed as `nlctl.analysis`.
"""

if __name__ == "analysis":  # its former name; a wheel has this file there, too
    from nlctl.host.former_name import use_former_name

    use_former_name()

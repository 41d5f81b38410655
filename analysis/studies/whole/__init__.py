"""Whether a run folder is whole: its sealed record, and the shapes of its files."""

"""Analysis of closed loops: metrics, figures, reports."""

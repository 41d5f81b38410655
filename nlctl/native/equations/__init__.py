"""The equations of a diagram as expressions: blocks read, and what switches in them found."""

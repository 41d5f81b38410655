"""What notebooks show: a heading and a table, in which everything that is given is text."""

import html
from collections.abc import Iterable, Sequence


def table_html(heading: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a heading and a table as HTML; every text is escaped."""
    paragraphs = "".join(f"<p>{html.escape(line)}</p>" for line in heading.splitlines())
    titles = "".join(f"<th>{html.escape(title)}</th>" for title in columns)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f"{paragraphs}<table><tr>{titles}</tr>{body}</table>"


def _cell(value: object) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return f"<td>{html.escape(text)}</td>"

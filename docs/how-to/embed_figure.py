"""
Embed a figure
==============

``nlctl.draw`` returns a matplotlib figure: a notebook shows it, a page takes its SVG.
"""

import io

import nlctl

figure = nlctl.draw(nlctl.paper.example_1(), title="Example 1")
text = io.StringIO()
figure.savefig(text, format="svg")
svg = text.getvalue()
assert svg.rstrip().endswith("</svg>")
figure  # noqa: B018

# %%
# In HTML, leave out what stands before the element:
element = svg[svg.index("<svg") :]
page = f"<!doctype html><title>Loop</title>{element}"
print(f"{len(page) / 1000:.0f} kB, {page.count('<path')} paths")

r"""
LaTeX of a block
================

``nlctl.typeset`` reads the equations from the functions that are run, so what is printed is what is simulated.
"""

import matplotlib.pyplot as plt

import nlctl

(law,) = nlctl.typeset(nlctl.block(nlctl.controllers.NussbaumLaw(), "law"))
for line in law.equations:
    print(line)

figure, axes = plt.subplots(figsize=(7, 1.6))
axes.axis("off")
for height, line in zip((0.7, 0.2), law.equations, strict=True):
    axes.text(0.5, height, f"${line}$", ha="center")

# %%
# The Nussbaum function of (24) has :math:`N(0) = 1`: with :math:`\zeta = 0`, :math:`r = 1` and the other inputs
# zero, the law is :math:`u = \beta`.
record = nlctl.controllers.NussbaumLaw(beta=2.5)
block = nlctl.block(record, "law")
u = [1.0 if name == "r" else 0.0 for name in block.input_labels]
print(block.input_labels, block.output(0, [0.0], u))
assert block.output(0, [0.0], u)[block.output_index["u"]] == 2.5

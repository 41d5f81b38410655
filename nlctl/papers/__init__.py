"""Papers as code: one module a paper, named by author and year, with its printed examples.

`nlctl.papers.tabuada_2007.example_1()` is a diagram like any other; ``nlctl report tabuada_2007``
writes the page that compares it with what is printed.
"""

from . import canudas_de_wit_1995, chowdhary_2010, karason_1994, lv_2017, tabuada_2007

__all__ = ["canudas_de_wit_1995", "chowdhary_2010", "karason_1994", "lv_2017", "tabuada_2007"]

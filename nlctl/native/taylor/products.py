"""Products in derivatives: factors that do not vary, and those that are 0."""

from ...expressions.graph import Expr, Graph


def constant_factors(node: Expr) -> tuple[list[Expr | None], Expr]:
    """Return what an expression is multiplied by that does not vary, and the rest; None for -1."""
    factors: list[Expr | None] = []
    while True:
        if node.op == "neg":
            factors.append(None)
            node = node.args[0]
        elif node.op == "mul" and not all(a.varies for a in node.args) and node.varies:
            varying = node.args[0].varies
            factors.append(node.args[1] if varying else node.args[0])
            node = node.args[0] if varying else node.args[1]
        else:
            return factors, node


def without_zeros(graph: Graph, node: Expr, function: Expr) -> Expr:
    """Return a derivative in which 0 x, which lets NaN through, is 0: x itself lets it through."""
    if node in (function, *function.args) or not node.varies or node.op == "leaf":
        return node
    if node.op == "mul" and any(a.op == "const" and a.data == 0.0 for a in node.args):
        return graph.const(0.0)
    return graph.op(node.op, *(without_zeros(graph, a, function) for a in node.args))

"""Pictures for notebooks, as SVG."""

import html
from typing import Any, Sequence

import numpy as np

# Palette that suits all kinds of colour vision (Okabe & Ito 2008).
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")


def plan_view(trajectories: Sequence[Any], caption: str, width: int = 420, height: int = 280) -> str:
    """Returns a plan view (x to the right, y up) of trajectories."""
    points = [t.positions[np.all(np.isfinite(t.positions[:, :2]), axis=1), :2] for t in trajectories]
    points = [p for p in points if len(p)]
    if not points:
        return f"<p>{html.escape(caption)}</p>"
    low = np.min([p.min(axis=0) for p in points], axis=0)
    high = np.max([p.max(axis=0) for p in points], axis=0)
    margin = 12
    scale = min((width - 2 * margin) / max(high[0] - low[0], 1e-9), (height - 2 * margin) / max(high[1] - low[1], 1e-9))
    lines = []
    for i, p in enumerate(points):
        p = p[:: max(1, len(p) // 500)]
        xy = np.column_stack([margin + (p[:, 0] - low[0]) * scale, height - margin - (p[:, 1] - low[1]) * scale])
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in xy)
        lines.append(f'<polyline points="{path}" fill="none" stroke="{COLOURS[i % 4]}" stroke-width="1.5"/>')
        lines.append(f'<circle cx="{xy[0, 0]:.1f}" cy="{xy[0, 1]:.1f}" r="3" fill="{COLOURS[i % 4]}"/>')
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}">' + "".join(lines) +
            f"</svg><p>{html.escape(caption)}</p>")


def table(rows: Sequence[Sequence[Any]], head: Sequence[str] = ()) -> str:
    """Returns an HTML table."""
    def cells(row: Sequence[Any], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(str(c))}</{tag}>" for c in row) + "</tr>"
    return "<table>" + (cells(head, "th") if head else "") + "".join(cells(r, "td") for r in rows) + "</table>"


def problem(p: Any) -> str:
    """Returns the counts of a problem and a picture of the sparsity of its Hessian."""
    statistics = p.statistics
    rows = [(k, statistics[k]) for k in ("variables", "unknowns", "costs", "constraints", "equalities", "inequalities")]
    rows += [(f"variables in {g}", n) for g, n in statistics["groups"].items()]
    rows += [(f"blocks: {r}", n) for r, n in statistics["residuals"].items()]
    bound = 1 + max((v for block in p._block_variables() for v in block), default=0)
    size = 200
    cells = min(bound, 60)
    marked = {(a * cells // bound, b * cells // bound) for block in p._block_variables() for a in block for b in block}
    side = size / cells
    squares = "".join(f'<rect x="{a * side:.1f}" y="{b * side:.1f}" width="{side:.1f}" height="{side:.1f}"/>'
                      for a, b in sorted(marked))
    return (table(rows) +
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{size}" height="{size}" fill="{COLOURS[0]}">'
            f'<rect width="{size}" height="{size}" fill="none" stroke="#777777"/>{squares}</svg>')

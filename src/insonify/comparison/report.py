"""Report of a comparison: text for a terminal, JSON, a picture, or a page with pictures."""

import base64
import html
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from insonify.comparison.measure import Curve
from insonify.comparison.result import Comparison, Finding, Value
from insonify.comparison.samples import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

SUFFIXES = (".html", ".json", ".png")
"""Suffixes of the reports that can be written."""
SHOWN = 4
"""Numbers of a measure that the text lists: those that differ most."""
DYNAMIC_RANGE = 70.0
"""Levels below the highest that pictures show [dB]."""
_REAL, _SIMULATED = "#0B3F73", "#D5350E"


def write_report(comparison: Comparison, path: str | Path) -> Path:
    """Write a report in the form of the suffix.

    Args:
        comparison: The comparison.
        path: File to write: .html, .json or .png.

    Raises:
        ValueError: Another suffix.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix == ".json":
        target.write_text(comparison.to_json(), encoding="utf-8")
    elif suffix == ".html":
        target.write_text(html_report(comparison), encoding="utf-8")
    elif suffix == ".png":
        target.write_bytes(_png(comparison, comparison.findings))
    else:
        raise ValueError(f"{target}: end its name in {', '.join(SUFFIXES)}")
    return target


def text_report(comparison: Comparison) -> str:
    """Report as text: each measure with its verdict and the numbers that differ most."""
    lines = [f"real       {comparison.real}", f"simulated  {comparison.simulated}", ""]
    for finding in comparison.findings:
        chance = f" (p = {finding.probability:.3f})" if np.isfinite(finding.probability) else ""
        lines.append(f"{finding.measure}: {finding.verdict}{chance}; {finding.reason}")
        shown = most_different(finding, SHOWN)
        width = max((len(_named(value)) for value in shown), default=0)
        lines += [f"  {_named(value):{width}}  {_numbers(value)}" for value in shown]
    lines += ["", *(f"note: {note}" for note in comparison.notes), "", comparison.summary()]
    return "\n".join(lines)


def most_different(finding: Finding, count: int) -> list[Value]:
    """Values of a finding with the least probabilities, in their own order."""
    known = [value for value in finding.values if np.isfinite(value.difference)]
    least = sorted(known, key=lambda value: (np.nan_to_num(value.probability, nan=2.0), -abs(value.difference)))[:count]
    return [value for value in known if value in least]


def _named(value: Value) -> str:
    return value.name if value.unit == "1" else f"{value.name} [{value.unit}]"


def _numbers(value: Value) -> str:
    ends = f" [{value.low:+.3g}, {value.high:+.3g}]" if np.isfinite(value.low) and value.high > value.low else ""
    if np.isfinite(value.real):
        return f"{value.real:9.3g} {value.simulated:9.3g}  difference {value.difference:+.3g}{ends}"
    return f"{value.difference:.3g}{ends}"


def html_report(comparison: Comparison) -> str:
    """Report as a page that needs no other file: table of all numbers, pictures on one scale."""
    parts = [
        f"<h1>{html.escape(comparison.real)} beside {html.escape(comparison.simulated)}</h1>",
        f"<p class=summary>{html.escape(comparison.summary())}.</p>",
        "<p>Verdicts: chance of any false difference in all measures together 5 % (Holm). Intervals of 95 % by "
        "bootstrap; none where one independent look gives none.</p>",
        "<ul>" + "".join(f"<li>{html.escape(note)}</li>" for note in comparison.notes) + "</ul>",
        _image(_png(comparison, ())),
    ]
    for finding in comparison.findings:
        chance = f", p = {finding.probability:.3f}" if np.isfinite(finding.probability) else ""
        parts.append(f"<h2>{html.escape(finding.measure)}: {finding.verdict}{chance}</h2>")
        parts.append(f"<p>{html.escape(finding.reason)}</p>")
        if finding.curves:
            parts.append(_image(_png(comparison, (finding,), with_levels=False)))
        parts.append(_table(finding))
    return _PAGE.replace("TITLE", html.escape(comparison.summary())).replace("BODY", "\n".join(parts))


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>TITLE</title><style>
body { font-family: sans-serif; max-width: 70em; margin: 2em auto; color: #1a1a1a }
table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .2em .8em; text-align: right }
td:first-child, th:first-child { text-align: left } tr:nth-child(even) { background: #f4f4f4 }
img { max-width: 100% } .summary { font-weight: bold } .differs { color: #b3261e }
</style></head><body>
BODY
</body></html>
"""


def _image(png: bytes) -> str:
    return f'<img alt="levels" src="data:image/png;base64,{base64.b64encode(png).decode("ascii")}">'


def _table(finding: Finding) -> str:
    head = "".join(f"<th>{name}</th>" for name in ("quantity", "real", "simulated", "difference", "95 % interval", "p"))
    rows = []
    for value in finding.values:
        ends = f"{value.low:+.3g} to {value.high:+.3g}" if np.isfinite(value.low) and value.high > value.low else ""
        cells = [_number(value.real), _number(value.simulated), _number(value.difference), ends,
                 _number(value.probability)]  # fmt: skip
        mark = " class=differs" if value.probability <= 0.05 and finding.verdict == "different" else ""
        rows.append(f"<tr{mark}><td>{html.escape(_named(value))}</td>" + "".join(f"<td>{c}</td>" for c in cells))
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else ""


def figure_of(comparison: Comparison, findings: tuple[Finding, ...], *, with_levels: bool = True) -> "Figure":
    """Levels of both recordings on one scale, and the curves of some findings.

    Args:
        comparison: The comparison.
        findings: Findings whose curves are drawn.
        with_levels: True to draw the levels of both recordings on top.
    """
    from insonify.plotting.style import new_figure

    curves = [(finding, curve) for finding in findings for curve in finding.curves]
    rows = int(with_levels) + -(-len(curves) // 2)
    figure = new_figure(11.0, 3.4 * max(rows, 1))
    grid = figure.add_gridspec(max(rows, 1), 2)
    if with_levels:
        top = max(float(np.nanmax(level)) for level in comparison.levels)
        axes = [figure.add_subplot(grid[0, side]) for side in (0, 1)]
        for axis, level, name in zip(axes, comparison.levels, (comparison.real, comparison.simulated), strict=True):
            drawn = _draw_level(axis, level, comparison, top)
            axis.set_title(name, fontsize=9)
        figure.colorbar(drawn, ax=axes, label="level [dB]")
    for panel, (finding, curve) in enumerate(curves):
        _draw_curve(figure.add_subplot(grid[int(with_levels) + panel // 2, panel % 2]), finding, curve)
    return figure


def _draw_level(axes: "Axes", level: Floats, comparison: Comparison, top: float) -> "AxesImage":
    from insonify.plotting.style import COPPER

    r = comparison.slant_range
    axes.grid(False)
    axes.set(xlabel="ping", ylabel="slant range [m]")
    return axes.imshow(
        level.T, aspect="auto", cmap=COPPER, vmin=top - DYNAMIC_RANGE, vmax=top, interpolation="nearest",
        extent=(-0.5, len(level) - 0.5, float(r[-1]), float(r[0])),
    )  # fmt: skip


def _draw_curve(axes: "Axes", finding: Finding, curve: Curve) -> None:
    axes.plot(curve.x, curve.real, color=_REAL, label="real")
    axes.plot(curve.x, curve.simulated, color=_SIMULATED, linestyle="--", label="simulated")
    axes.set(xlabel=curve.x_label, ylabel=curve.y_label)
    axes.set_title(f"{finding.measure}: {finding.verdict}", fontsize=10)
    axes.legend()


def _png(comparison: Comparison, findings: tuple[Finding, ...], *, with_levels: bool = True) -> bytes:
    from insonify.plotting.style import plot_style

    buffer = io.BytesIO()
    with plot_style():
        figure_of(comparison, findings, with_levels=with_levels).savefig(buffer, format="png",
                                                                         metadata={"Software": None})  # fmt: skip
    return buffer.getvalue()

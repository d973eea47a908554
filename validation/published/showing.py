"""Cases as markdown tables, and a figure of all deviations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from lumped.figures.drawing import panels
from validation.published.cases import PublishedCase, PublishedRow

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINEAR_TO = 2.0  # per cent, of the axis of the figure
TABLE_HEADER = "quantity", "method", "unit", "published", "ours", "deviation [%]"
SUMMARY_HEADER = "quantity", "method", "pairs", "deviations [%]"


def markdown(cases: Sequence[PublishedCase]) -> str:
    """Title, source, assumptions and table of each case.

    A case of several pairs has a line for each quantity, with the smallest and the
    largest deviation. Titles are bold, as the output of a notebook has no headings.

    Parameters
    ----------
    cases : sequence of PublishedCase
        Cases in the order of the text.

    Returns
    -------
    str
        Markdown, with tables of the GitHub dialect.
    """
    return "\n\n".join(part for case in cases for part in _parts(case)) + "\n"


def _parts(case: PublishedCase) -> Iterator[str]:
    yield f"**{case.title}**"
    yield f"Source: {case.source}"
    yield "\n".join(f"- {line}" for line in case.inputs)
    groups = _by_quantity(case.rows)
    explanations = [text for group in groups if (text := _explanation(group))]
    numbers = {text: n for n, text in enumerate(dict.fromkeys(explanations), 1)}
    marks = [_explanation_mark(numbers.get(_explanation(group))) for group in groups]
    if any(row.subject for row in case.rows):
        cells = map(_summary_cells, groups)
        yield _table(SUMMARY_HEADER, _lines_with_marks(cells, marks))
    else:
        yield _table(
            TABLE_HEADER,
            _lines_with_marks((_cells(row) for (row,) in groups), marks),
        )
    yield "\n".join(f"{number}. {text}" for text, number in numbers.items())
    definitions = {row.quantity: row.definition for row in reversed(case.rows)}
    quantities = dict.fromkeys(row.quantity for row in case.rows)
    lines = [f"- {name}: {definitions[name]}" for name in quantities]
    noted = ((f"{row.quantity}, {row.method}", row.note) for row in case.rows)
    yield "\n".join(lines + [f"- {name}: {note}" for name, note in noted if note])


def _explanation(rows: Sequence[PublishedRow]) -> str:
    """Why deviations are large, empty where they are not."""
    return " ".join(dict.fromkeys(row.explanation for row in rows if row.is_explained))


def _explanation_mark(number: int | None) -> str:
    """The number of an explanation below the table."""
    return f" ({number})" if number else ""


def _lines_with_marks(
    lines: Iterable[Sequence[str]], marks: Sequence[str]
) -> Iterator[tuple[str, ...]]:
    for (*cells, deviation), mark in zip(lines, marks, strict=True):
        yield *cells, f"{deviation}{mark}"


def pair_table(case: PublishedCase) -> str:
    """Every row of a case of several pairs, as a markdown table."""
    return _table(
        ("pair", *TABLE_HEADER), ((row.subject, *_cells(row)) for row in case.rows)
    )


def _table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    rows = [head, ["---"] * len(head), *lines]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in rows)


def _cells(row: PublishedRow) -> tuple[str, ...]:
    numbers = f"{row.published:.7g}", f"{row.ours:.7g}", _per_cent(row.per_cent)
    return row.quantity, row.method, row.unit, *numbers


def _by_quantity(rows: Sequence[PublishedRow]) -> list[list[PublishedRow]]:
    grouped = groupby(rows, key=lambda row: (row.quantity, row.method))
    return [list(group) for _, group in grouped]


def _summary_cells(rows: Sequence[PublishedRow]) -> tuple[str, ...]:
    deviations = [row.per_cent for row in rows]
    ends = f"{_per_cent(min(deviations))} to {_per_cent(max(deviations))}"
    return rows[0].quantity, rows[0].method, str(len(rows)), ends


def _per_cent(value: float) -> str:
    return f"{value:+.2g}" if abs(value) < 1.0 else f"{value:+.1f}"


def draw(cases: Sequence[PublishedCase]) -> Figure:
    """Deviation of each row in per cent, by case, linear within 2 %.

    Parameters
    ----------
    cases : sequence of PublishedCase
        Cases, from the top.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each case; hollow marks are explained deviations.
    """
    grouped = [_by_quantity(case.rows) for case in cases]
    heights = [len(groups) + 1.0 for groups in grouped]
    figure, axes = panels(
        len(cases), size=(9.0, 0.26 * sum(heights)), heights=heights, share=True
    )
    for case, groups, (panel,) in zip(cases, grouped, axes, strict=True):
        _draw_case(panel, case, groups)
    axes[-1][0].set_xlabel("deviation from the published value [%]")
    return figure


def _draw_case(
    panel: Axes, case: PublishedCase, groups: list[list[PublishedRow]]
) -> None:
    panel.set_title(case.title, fontsize=9, loc="left")
    panel.axvspan(-LINEAR_TO, LINEAR_TO, color="0.92", zorder=0)
    for place, rows in enumerate(groups):
        for row in rows:
            face = "none" if row.is_explained else "tab:blue"
            panel.plot(
                row.per_cent, place, "o", color="tab:blue", markerfacecolor=face, ms=5
            )
    labels = [f"{rows[0].quantity}, {rows[0].method}" for rows in groups]
    panel.set_yticks(range(len(groups)), labels, fontsize=7)
    panel.set_ylim(len(groups) - 0.5, -0.5)
    panel.set_xscale("symlog", linthresh=LINEAR_TO)
    ticks = [-50, -20, -10, -5, -2, 0, 2, 5, 10, 20, 50]
    panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks], fontsize=7)
    panel.minorticks_off()

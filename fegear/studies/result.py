"""Results of studies: shown, tabulated, drawn, written and saved."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fegear.files.errors import InputError
from fegear.result import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from fegear.studies.page import Page
    from fegear.studies.table import Table

Draw = Callable[[], "Figure"]


class StudyResult(Result):
    """Result of a study; a frozen dataclass.

    Results of the studies have further attributes with what they computed.

    Attributes
    ----------
    study : Study
        Study that was run.
    summary : dict of str
        Plain values for JSON, warnings among them; names end with units.
    figures : mapping of str to callable
        Functions that draw the pictures of the study, by name.
    more_tables : mapping of str to Table
        Tables in addition to the first, by name.
    more_files : mapping of str to callable
        Functions of a path that write other files, by name.
    complete : bool
        Whether nothing is left out, after Ctrl-C or a failure.
    empty : bool
        Whether there is nothing to write.
    failure : str
        Why the command fails, once all is written; empty if it does not.
    dots_per_inch : int
        Resolution of pictures [dots per inch].
    """

    study: Any
    summary: Any
    figures: Any = MappingProxyType({})
    more_tables: Any = MappingProxyType({})
    more_files: Any = MappingProxyType({})
    complete: Any = True
    empty: Any = False
    failure: Any = ""
    dots_per_inch: Any = 130  # of pictures

    @property
    def table(self) -> Table:
        """Table of the result; names of columns end with units."""
        raise InputError(f"{self.study.command} has no table")

    def page(self) -> Page:
        """Content of the screen.

        Returns
        -------
        iterator of str, RowTable or ColumnTable
            Lines of text and tables, in order.
        """
        raise NotImplementedError

    def write(self, path: str | Path) -> None:
        """Write what ``--output`` of the command writes, by the ending of the path.

        Unless the study says else, ``.csv`` has the table, ``.mat`` and ``.xlsx`` have
        all tables with units and meanings, and ``.nc`` has the whole result, as `save`.

        Parameters
        ----------
        path : str or Path
            File, or directory of a study that writes several files.

        Raises
        ------
        InputError
            If the ending is another one, the file cannot be written or does not hold
            the tables, or a package that writes it is missing.
        """
        from fegear.studies.table_files import write_result

        write_result(self, path)

    def write_table(self, path: str | Path, name: str) -> None:
        """Write one of `more_tables` alone, by the ending of the path.

        Parameters
        ----------
        path : str or Path
            File with the ending ``.csv``, ``.mat`` or ``.xlsx``.
        name : str
            Name of the table, one of `more_tables`.

        Raises
        ------
        InputError
            If there is no such table or ending, or the file cannot be written.
        """
        from fegear.studies.table_files import write_table

        write_table(self, path, name)

    def save(self, path: str | Path) -> None:
        """Write the whole result for `fegear.load`.

        Parameters
        ----------
        path : str or Path
            File with the ending ``.nc``.

        Raises
        ------
        InputError
            If the ending is another one, the file cannot be written or a value cannot
            be saved.
        """
        from fegear.studies.saving import save

        save(self, path)

    def to_csv(self, path: str | Path) -> None:
        """Write the table with its header.

        Parameters
        ----------
        path : str or Path
            CSV file.

        Raises
        ------
        InputError
            If the study has no table or the file cannot be written.
        """
        from fegear.files.output import path_of, write_text

        write_text(path_of(path), self.table.csv())

    def to_frame(self) -> DataFrame:
        """The table as a pandas frame.

        Returns
        -------
        pandas.DataFrame
            A column for each column of `table`.

        Raises
        ------
        ImportError
            If pandas is missing.
        InputError
            If the study has no table.
        """
        return self.table.to_frame()

    def draw(self, path: str | Path, name: str = "plot") -> None:
        """Draw a picture by the ending of the path.

        Parameters
        ----------
        path : str or Path
            Picture, with the ending ``.png``, ``.pdf``, ``.svg`` or ``.html``.
        name : str, optional
            Name of the picture, one of `figures`.

        Raises
        ------
        InputError
            If there is no such picture or ending, or the file cannot be written.
        """
        from fegear.figures.saving import save_figure
        from fegear.files.output import path_of, require_picture, write_whole

        if name not in self.figures:
            drawn = f"drawn are {', '.join(self.figures)}"
            raise InputError(f"name = {name}; {drawn if self.figures else 'none is'}")
        target = path_of(path)
        require_picture(target)
        figure = self.figures[name]
        write_whole(
            target, lambda place: save_figure(figure(), place, self.dots_per_inch)
        )

    def __str__(self) -> str:
        """The page of the result, as the command prints it."""
        from fegear.studies.page_text import page_text

        return page_text(self.page())

    def _repr_html_(self) -> str:
        """The page of the result in a notebook, with its figure."""
        from fegear.studies.notebook import page_html

        return page_html(self.page(), self._first_figure(), self.dots_per_inch)

    def _repr_png_(self) -> bytes | None:
        """The first figure that can be drawn, None where there is none."""
        from fegear.studies.notebook import figure_png

        figure = self._first_figure()
        return None if figure is None else figure_png(figure, self.dots_per_inch)

    def _first_figure(self) -> Figure | None:
        for draw in self.figures.values():
            with suppress(InputError):  # of a figure that these settings do not give
                return draw()
        return None

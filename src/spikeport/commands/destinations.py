"""The places that a compile writes image and report to, by options of its command.

This module imports no Nengo: help does not wait for it.
"""

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from spikeport.atomic import check_apart, check_output, check_results_folder, locked
from spikeport.commands.image_file import IMAGE
from spikeport.commands.options import written

if TYPE_CHECKING:
    from spikeport.compile.image.chip_image import ChipImage
    from spikeport.compile.report.report import Json

REPORT = "report.json"
"""The file of the report in the folder."""


@dataclass(frozen=True, kw_only=True)
class Destinations:
    """The folder and files that a user asked for.

    Attributes
    ----------
    out : Path or None
        The folder of image and report.
    json, html : Path or None
        The files of the report as data, and as a page.
    """

    out: Annotated[Path | None, written("Write image and report to this folder.")] = None
    json: Annotated[Path | None, written("Write the report to this file, as JSON.")] = None
    html: Annotated[Path | None, written("Write the report to this file, as a web page.")] = None

    def check(self, *reads: Path) -> None:
        """Raise UsageError, before the work, for an output that is not writable, or an input.

        Also for the folder of a run, and for one that another process writes into at the moment.
        """
        if self.out is not None:
            check_results_folder("--out", self.out)
            if self.out.exists():
                with self.alone():
                    pass
        for name, path in (("json", self.json), ("html", self.html)):
            if path is not None:
                check_output(f"--{name}", path, *reads, suffix=f".{name}")
        check_apart(self._files())

    def _files(self) -> Iterator[tuple[str, Path]]:
        """Yield the options, each with a file that it writes."""
        if self.out is not None:
            yield from (("--out", self.out / name) for name in (IMAGE, REPORT))
        # --json may name the report in the folder: that is one file.
        if self.json is not None and not self._holds_report(self.json):
            yield "--json", self.json
        if self.html is not None:
            yield "--html", self.html

    def _holds_report(self, path: Path) -> bool:
        if self.out is None:
            return False
        return os.path.realpath(path) == os.path.realpath(self.out / REPORT)

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Lock the folder while its files are written, which are then all of one command.

        Raises
        ------
        UsageError
            If another process writes into it.
        """
        if self.out is None:
            yield
            return
        self.out.mkdir(parents=True, exist_ok=True)
        with locked(self.out):
            yield

    def write_image(self, image: "ChipImage") -> None:
        """Write an image to the folder, if there is one."""
        if self.out is not None:
            image.save(self.out / IMAGE)

    def write_report(self, report: "Json", title: str) -> None:
        """Write a report to the folder, the file and the page that the user asked for."""
        from spikeport.files import write_json  # imports pydantic

        for path in (self.out and self.out / REPORT, self.json):
            if path is not None:
                write_json(path, report)
        if self.html is not None:
            from spikeport.compile.report.page import write_page  # imports jinja2

            write_page(self.html, report, title)

    def write_refusal(self, report: "Json", title: str) -> None:
        """Write the report on a refused network, but not in place of the one on an image."""
        outside = replace(self, out=None)
        if self.out is not None and self.json is not None and self._holds_report(self.json):
            if (self.out / IMAGE).exists():
                outside = replace(outside, json=None)
                print(f"not written: {self.json}, which is the report on {self.out / IMAGE}")
            else:
                self.out.mkdir(parents=True, exist_ok=True)
        outside.write_report(report, title)
        outside.note()

    def remove_image(self) -> None:
        """Remove the image of an earlier compile from the folder: the report is of another one."""
        if self.out is not None:
            (self.out / IMAGE).unlink(missing_ok=True)

    def note(self) -> None:
        """Print where image and report are, if they were asked for."""
        folder = [] if self.out is None else [f"{self.out}/"]
        files = [str(path) for path in (self.json, self.html) if path is not None]
        if folder or files:
            print(f"written: {', '.join([*folder, *files])}")

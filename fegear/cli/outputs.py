"""Files that a command writes, how it shows its results, and whether it resumes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import MISSING, dataclass, field, replace
from inspect import Parameter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fegear.cli.parameters import option_parameter
from fegear.cli.progress import progress_bar
from fegear.cli.screen import print_json, print_warnings
from fegear.files.errors import InputError
from fegear.files.output import (
    SINGLE_TABLES,
    file_identity,
    make_directory,
    require_ending,
    require_no_input,
    require_picture,
    require_writable,
    taken_error,
)
from fegear.studies.settings import group_of, options_of, stated

if TYPE_CHECKING:
    from fegear.files.store import CheckpointOptions
    from fegear.studies.study import Study
    from lumped.common.progress import Progress


def output_parameters(study: type[Study]) -> Iterator[Parameter]:
    """Options of all files that a study writes, and how results are shown."""
    if study.output_names:
        yield option_parameter(
            "output",
            Path | None,
            study.output,
            *study.output_names,
            default=MISSING if study.must_write else None,
            metavar="DIR" if study.folder else None,
        )
    for name, text in _file_help(study).items():
        yield option_parameter(name, Path | None, text)
    if study.resumes:
        run = f"an interrupted run with the same --{study.checkpoint_beside}"
        for name, verb in (("resume", "Resume"), ("overwrite", "Discard")):
            yield option_parameter(name, bool, f"{verb} {run}.", default=False)
    text = "Print the results as JSON instead of tables."
    yield option_parameter("as_json", bool, text, "--json", default=False)


def _file_help(study: type[Study] | Study) -> dict[str, str]:
    """Help of the files besides the output, by their options."""
    more_files = {name: text for name, (text, _) in study.more_files.items()}
    return {**study.pictures, **study.more_tables, **more_files}


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """Files that a run writes, and how it shows its results.

    output : None where it is not asked for, or the study has its own setting
    files : other files that are asked for, by the names of their options
    overwrite : discard the records of an earlier run
    """

    output: Path | None = None
    files: Mapping[str, Path] = field(default_factory=dict)
    as_json: bool = False
    resume: bool = False
    overwrite: bool = False

    @classmethod
    def of(cls, study: type[Study], values: Mapping[str, Any]) -> Outputs:
        """Outputs by the values of `output_parameters`."""
        files = {name: values[name] for name in _file_help(study) if values[name]}
        names = "output", "as_json", "resume", "overwrite"
        options = {name: values[name] for name in names if name in values}
        outputs = cls(files=files, **options)
        checkpoint_option = study.checkpoint_beside
        if outputs.resume and outputs.checkpoint(study) is None:
            raise InputError(
                f"--resume needs the --{checkpoint_option} of the run to resume"
            )
        if outputs.overwrite and outputs.checkpoint(study) is None:
            refuse_unused_options(f"needs --{checkpoint_option}", overwrite=True)
        if outputs.overwrite and outputs.resume:
            reason = "--resume keeps what --overwrite drops"
            refuse_unused_options(reason, overwrite=True)
        return outputs

    def checkpoint(self, study: type[Study] | Study) -> Path | None:
        """The checkpoint, which stays until all files are written."""
        if not study.resumes:
            return None
        path = {"output": self.output, **self.files}.get(study.checkpoint_beside)
        return None if path is None else Path(f"{path}.partial")

    def checkpoint_options(self, study: Study) -> CheckpointOptions:
        from fegear.files.store import CheckpointOptions

        return CheckpointOptions(
            checkpoint=self.checkpoint(study),
            resume=self.resume,
            overwrite=self.overwrite,
        )

    def show(
        self,
        values: dict[str, Any],
        print_values: Callable[[dict[str, Any]], None],
        printed_lines: Sequence[str] = (),
    ) -> None:
        """Print the result as JSON or by the function, and a line for each warning.

        said : lines that were printed before
        """
        (print_json if self.as_json else print_values)(values)
        print_warnings(w for w in values.get("warnings", ()) if w not in printed_lines)

    def progress(self) -> AbstractContextManager[Progress]:
        """A bar, unless the screen is for JSON."""
        return progress_bar(enabled=not self.as_json)


def check_outputs(study: Study, outputs: Outputs) -> None:
    """Refuse files that cannot be written and options that would have no effect."""
    files = dict(outputs.files)
    wanted_outputs: dict[str, Any] = {"output": outputs.output, **files}
    wanted_outputs |= {"resume": outputs.resume, "overwrite": outputs.overwrite}
    wanted_outputs = {name: value for name, value in wanted_outputs.items() if value}
    names = options_of(group_of(study)) | {
        n: f"--{n}" for n in ("output", *_file_help(study))
    }
    for name, reason in study.unused_options(wanted_outputs):
        value = wanted_outputs.get(name, getattr(study, name, None))
        if name not in wanted_outputs and isinstance(value, tuple):
            value = stated(study, name)
        refuse_unused_options(reason.format_map(names), **{name: value})
    plot = files.pop("plot", None)
    if not study.folder:
        require_ending(outputs.output, study.endings)
    require_outputs([None if study.folder else outputs.output], plot=plot)
    if (checkpoint := outputs.checkpoint(study)) is not None:
        require_no_input(checkpoint)
    earlier_outputs = [path for path in (outputs.output, plot) if path is not None]
    for name, path in files.items():
        if name in study.pictures:
            require_outputs([], earlier_outputs, path)
        else:
            require_ending(path, study.more_files.get(name, ("", SINGLE_TABLES))[1])
            require_outputs([path], earlier_outputs)
        earlier_outputs.append(path)


def make_output_directory(study: Study, outputs: Outputs) -> Outputs:
    """The outputs; the directory of a study that writes one is made."""
    directory = outputs.output or study.default_output
    if not study.folder or directory is None:
        return outputs
    folder = make_directory(directory)
    require_outputs([folder / name for name in study.files])
    return replace(outputs, output=folder)


def write_outputs(result: Any, outputs: Outputs) -> None:
    """Write all files of a result."""
    if outputs.output is not None:
        result.write(outputs.output)
    for name in _file_help(result.study):
        path = outputs.files.get(name)
        if path is None:
            continue
        if name in result.study.more_tables:
            result.write_table(path, name)
        elif name in result.study.more_files:
            result.more_files[name](path)
        else:
            result.draw(path, name)


def refuse_unused_options(reason: str, **options: Any) -> None:
    """Refuse options that would change nothing.

    reason : why, such as `needs --excitation trapezoid`
    options : by name, None for those that are not given
    """
    for name, value in options.items():
        if value is not None and value is not False:
            values = value if isinstance(value, list) else [value]
            texts = (f"{v:.12g}" if isinstance(v, float) else str(v) for v in values)
            shown = "" if value is True else f" = {', '.join(texts)}"
            raise InputError(f"--{name.replace('_', '-')}{shown}; {reason}")


def require_outputs(
    outputs: Sequence[Path | None],
    others: Sequence[Path] = (),
    plot: Path | None = None,
) -> None:
    """Files can be written, and differ from each other and from other outputs.

    plot : one more output, a picture by its ending
    """
    if plot is not None:
        require_picture(plot)
    taken_files = {file_identity(path) for path in others}
    for path in (*outputs, plot):
        if path is None:
            continue
        require_writable(path)
        identity = file_identity(path)
        if identity in taken_files and not str(path).startswith("/dev/"):
            raise taken_error(path)
        taken_files.add(identity)

"""The command: `fsiwork VERB`. Speaks to the shell; what is done stands elsewhere."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from fsiwork.artefacts import register

app = typer.Typer(
    help="Level-set fluid-structure interaction: from a scene in YAML to data and pictures.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="A scene (.yaml, .json), or a run (.nc) to repeat.")]
RunFile = Annotated[Path, typer.Argument(metavar="RUN.nc", help="The file of a run.")]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Replace one value, as in box.cells=64.")
]


class Refused(Exception):
    """What was asked for cannot be done; one line for each reason."""

    def __init__(self, *faults: str):
        super().__init__("\n".join(faults))
        self.faults = list(faults)


def scene_of(path: Path, settings: list[str] | None):
    """The scene in a file, with the values of ``--set a.b=c`` replaced. Raises with all faults."""
    from fsiwork import scene

    overrides: dict[str, Any] = {}
    for setting in settings or ():
        name, equals, value = setting.partition("=")
        if not equals:
            raise Refused(f"--set {setting}: write a.b.c=value")
        overrides[name.strip()] = scene.parse(value, f"--set {name}")
    if path.suffix == ".nc":
        with _in_one_line(ValueError):
            from fsiwork.dataset import open_run

            with open_run(path) as ds:
                return scene.loads(ds.attrs["scene"], overrides, str(path))
    return scene.load(path, overrides)


@app.command()
def check(
    scenes: Annotated[list[Path], typer.Argument(metavar="SCENE...", help="Scenes to check.")],
    settings: Settings = None,
) -> None:
    """Say whether scenes can be simulated; one line for each fault."""
    from fsiwork.scene import SceneError

    faults = []
    for path in scenes:
        try:
            scene_of(path, settings)
        except SceneError as error:
            faults += error.faults if len(scenes) == 1 else [f"{path}: {line}" for line in error.faults]
        else:
            typer.echo(f"{path}: in order")
    if faults:
        raise Refused(*faults)


@app.command()
def plan(scene: SceneFile, settings: Settings = None) -> None:
    """Say what a run takes: fields, solvers, memory, steps and time. Refuses what exceeds the memory."""
    from fsiwork.plan import describe, estimate, refuse

    found = scene_of(scene, settings)
    typer.echo(describe(estimate(found)))
    refuse(found)


@app.command()
def run(
    scene: SceneFile,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT.nc", help="The file to write.")],
    settings: Settings = None,
    max_seconds: Annotated[
        float | None, typer.Option(min=0.0, help="Stop after so many seconds; --resume goes on.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the state that a stopped run left.")] = False,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Threads of the kernels (default: NUMBA_NUM_THREADS or 1).")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Simulate a scene into a netCDF file. A run that diverges is data too: the file says when and why."""
    from fsiwork import provenance, running
    from fsiwork.plan import refuse

    provenance.die_with_parent()
    found = scene_of(scene, settings)
    if output.suffix != ".nc" or output.is_dir():
        raise Refused(f"{output}: the file of a run ends in .nc and is no folder")
    refuse(found)
    if threads:
        running.set_threads(threads)
    with _progress(found.clock.end, str(output), quiet) as watch, _in_one_line(ValueError, RuntimeError):
        ended = running.to_file(found, output, resume=resume, max_seconds=max_seconds, watch=watch)
    hint = f"; go on with --resume (kept in {output}.frames)" if ended.startswith("stopped") else ""
    typer.echo(f"{output}: {ended}{hint}")


@app.command()
def show(
    run_file: RunFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help=".png or .gif; default RUN.png.")
    ] = None,
) -> None:
    """Draw fields and gauges of a run: a picture (.png) or a film (.gif)."""
    with _in_one_line(ValueError):
        from fsiwork.dataset import open_run
        from fsiwork.figures.show import show as draw

        with open_run(run_file) as ds:
            path = draw(ds, output or run_file.with_suffix(".png"))
            typer.echo(f"{path}: {ds.attrs['ended']}, {ds.sizes.get('t', 0)} frames to t = {float(ds['t'][-1]):.6g}")


@app.command()
def export(
    run_file: RunFile,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="Where the VTK files go.")],
) -> None:
    """Write the frames of a run as VTK files, for ParaView."""
    with _in_one_line(ValueError):
        from fsiwork.dataset import open_run
        from fsiwork.export import export as write

        with open_run(run_file) as ds:
            typer.echo(str(write(ds, output)))


@app.command()
def segment(
    image: Annotated[Path, typer.Argument(metavar="IMAGE", help="A picture (.png, .jpg, …), or an array (.npy).")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT.nc", help="The file to write.")],
    smoothing: Annotated[float, typer.Option(min=0.1, help="Radius [pixels] below which a spot is noise.")] = 2.5,
    start: Annotated[str, typer.Option(help="around: one contour around all; levels: also finds holes.")] = "around",
) -> None:
    """Part a picture or a volume of two levels by active contours."""
    with _in_one_line(ValueError):
        from fsiwork.segmenting import to_file

        typer.echo(f"{output}: {to_file(image, output, smoothing, start)}")


@app.command()
def schema(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Default: to the screen.")
    ] = None,
) -> None:
    """The JSON schema of a scene, with which an editor completes and checks the YAML."""
    from fsiwork.scene import Scene

    text = json.dumps(Scene.model_json_schema(), indent=1, ensure_ascii=False, sort_keys=True) + "\n"
    if output:
        output.write_text(text, encoding="utf-8")
    else:
        typer.echo(text, nl=False)


register(app)


@contextmanager
def _in_one_line(*expected: type[Exception]) -> Iterator[None]:
    """Errors of these kinds, whose text is one clear line, end the command with that line."""
    try:
        yield
    except expected as error:
        raise error if hasattr(error, "faults") else Refused(" ".join(str(error).split())) from error


@contextmanager
def _progress(end: float, name: str, quiet: bool) -> Iterator[Callable[[Any], None] | None]:
    """Something that watches frames go by: a bar with the time left, or now and then a line in a log."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task(name, total=end)
            yield lambda frame: bar.update(task, completed=frame.t, description=f"{name} t = {frame.t:.4g}")
    else:
        yield _Log(end)


class _Log:
    """A line in a log at most every ``every`` seconds."""

    def __init__(self, end: float, every: float = 30.0):
        self.end, self.every = end, every
        self.began = self.last = time.monotonic()
        self.first: float | None = None

    def __call__(self, frame: Any) -> None:
        now = time.monotonic()
        if frame.t == 0.0:
            return
        if self.first is None:  # before it kernels may have been compiled
            self.first, self.began = frame.t, now
        elif now - self.last > self.every:
            left = (now - self.began) * (self.end - frame.t) / (frame.t - self.first)
            print(f"t = {frame.t:.4g} of {self.end:.4g}, {left:.0f} s left", file=sys.stderr, flush=True)
            self.last = now


INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code: 0, 1 (the machine refuses), 2 (the input is wrong), 130 (interrupted)."""
    code, lines = 0, []
    try:
        code = app(arguments, prog_name="fsiwork", standalone_mode=False)
    except KeyboardInterrupt:
        code = INTERRUPTED
    except MemoryError:
        code, lines = 1, ["out of memory"]
    except BrokenPipeError:
        sys.stderr.close()  # nobody listens any more
        return 1
    except OSError as error:
        code, lines = 1, [_of_system(error)]
    except Exception as error:
        if hasattr(error, "faults"):
            code, lines = 2, error.faults
        elif hasattr(error, "format_message"):  # of the command line
            code, lines = 2, [" ".join(error.format_message().split())]
        elif hasattr(error, "exit_code"):
            code = error.exit_code
        else:
            raise
    if code == INTERRUPTED:  # typer turns the interrupt into this code without a word
        lines = ["interrupted"]
    for line in lines:
        print(line, file=sys.stderr)
    return code if isinstance(code, int) else 0


def _of_system(error: OSError) -> str:
    if error.filename and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())


if __name__ == "__main__":
    sys.exit(main())

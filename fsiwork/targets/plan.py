"""The names of all results and what each is made of, for the rules of the workflow and for the command."""

import ast
import hashlib
import json
import re
from dataclasses import asdict
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fsiwork.sources import source_hash
from fsiwork.targets.book import Entry, load_book
from fsiwork.targets.reading import SIZES, Faults
from fsiwork.targets.studies import Point, Study, load_study

PACKAGE = Path(__file__).resolve().parents[1]


class Plan:
    """Results of the book under ``results/SIZE/``; methods that take wildcards ``w`` are functions of the rules."""

    def __init__(self, configs: str | Path = "configs", results: str | Path = "results"):
        self.configs, self.results = Path(configs), Path(results)
        self._books: dict[str, dict[str, Entry]] = {}
        self._studies: dict[tuple[str, str], Study] = {}

    # ---------------------------------------------------------------------------------------------- what there is
    def book(self, size: str) -> dict[str, Entry]:
        """Entries at a size, by id. Raises `Faults`."""
        if size not in SIZES:
            raise Faults(f"size: must be one of {', '.join(SIZES)}, got {size!r}")
        if size not in self._books:
            self._books[size] = load_book(self.configs / "book.yaml", size)
        return self._books[size]

    def entry(self, name: str, size: str) -> Entry:
        """One entry. Raises `Faults` that name the known ids."""
        book = self.book(size)
        if name not in book:
            raise Faults(f"{name}: is not in {self.configs / 'book.yaml'}; there are {', '.join(book)}")
        return book[name]

    def study(self, name: str, size: str) -> Study:
        """A study at a size. Raises `Faults`."""
        if size not in SIZES:
            raise Faults(f"size: must be one of {', '.join(SIZES)}, got {size!r}")
        if (name, size) not in self._studies:
            self._studies[name, size] = load_study(self.configs / "studies" / f"{name}.yaml", size)
        return self._studies[name, size]

    def studies(self, size: str) -> list[Study]:
        """Every study that the book needs, once."""
        names = dict.fromkeys(name for entry in self.book(size).values() for name in entry.studies)
        return [self.study(name, size) for name in names]

    def points(self, study: Study, job: str) -> list[Point]:
        """The points of a job. Raises `Faults` that name the known jobs."""
        if job not in study.batches:
            raise Faults(f"{study.name}: there is no job {job!r}; there are {', '.join(study.batches)}")
        return study.batches[job]

    def chapters(self, size: str) -> dict[int, list[str]]:
        """Ids of each chapter."""
        found: dict[int, list[str]] = {}
        for name, entry in self.book(size).items():
            found.setdefault(entry.chapter, []).append(name)
        return dict(sorted(found.items()))

    def scene(self, study: Study) -> Path | None:
        """The scene's file of a study."""
        return self.configs / "scenes" / f"{study.scene}.yaml" if study.scene else None

    # -------------------------------------------------------------------------------------------------- file names
    def file(self, size: str, kind: str, name: str) -> str:
        """``results/SIZE/KIND/NAME.EXT`` for a kind of studies, figures, tables, checks."""
        extension = {"studies": "nc", "figures": "png", "tables": "csv", "checks": "json"}[kind]
        return str(self.results / size / kind / f"{name}.{extension}")

    def jobs(self, size: str, name: str) -> list[str]:
        """Files that a study is joined from: a run for each point, or a JSON file for each job of calls."""
        study, place = self.study(name, size), self.results / size / "runs" / name
        if study.work == "call":
            return [str(place / f"{job}.json") for job in study.batches]
        return [str(place / f"{point.name}.nc") for point in study.points]

    def batched(self, size: str) -> dict[str, list[str]]:
        """Studies that compute several runs in one job, with the names of a job's runs as patterns of ``{job}``."""
        found = {}
        for study in self.studies(size):
            if study.work == "batch":
                stem = "" if set(study.batch) == set(study.axes) else "{job}"
                found[study.name] = [stem + tail for tail in study.tails]
        return found

    def products(self, size: str, name: str) -> list[str]:
        """All that `snakemake ID` makes: datasets, checks, figure, table."""
        entry = self.entry(name, size)
        pictures = [self.file(size, f"{kind}s", name) for kind in ("figure", "table") if getattr(entry, kind)]
        return [self.file(size, "studies", s) for s in entry.studies] + [self.file(size, "checks", name), *pictures]

    def everything(self, size: str) -> list[str]:
        """All files of the book at a size, runs included, so that a deleted one is noticed."""
        runs = [file for study in self.studies(size) for file in self.jobs(size, study.name)]
        return list(dict.fromkeys(runs + [file for name in self.book(size) for file in self.products(size, name)]))

    # ------------------------------------------------------------------------------------- functions of wildcards
    def pattern(self, size: str, work: str) -> str:
        """Wildcard constraint: the studies whose jobs are of a kind (see `Study.work`)."""
        return "|".join(re.escape(s.name) for s in self.studies(size) if s.work == work) or "(?!)"

    def scene_of(self, w: Any) -> list[str]:
        """Scene file of a job, as input."""
        scene = self.scene(self.study(w.study, w.size))
        return [str(scene)] if scene else []

    def options_of(self, w: Any) -> str:
        """The overrides of a plain run as options of the command."""
        study = self.study(w.study, w.size)
        return self.points(study, w.job)[0].options

    def job_of(self, w: Any) -> str:
        """The job of a rule; without wildcard the only one."""
        return getattr(w, "job", "all")

    def definition_of(self, w: Any, study: str | None = None) -> str:
        """A job as JSON: what it depends on beside its scene and the sources."""
        found = self.study(study or w.study, w.size)
        points = [asdict(point) for point in self.points(found, self.job_of(w))]
        return json.dumps([found.kind, found.call, found.args, points], sort_keys=True)

    def code_of(self, w: Any, study: str | None = None) -> str:
        """Hash of the sources a job depends on."""
        found = self.study(study or w.study, w.size)
        solver = _solver(bool(found.scene))
        return f"{solver}-{sources(found.call, 'studies')}" if found.call else solver

    def jobs_of(self, w: Any) -> list[str]:
        """Files that a study is joined from."""
        return self.jobs(w.size, w.study)

    def points_of(self, w: Any) -> str:
        """What the join depends on beside its files."""
        study = self.study(w.study, w.size)
        return json.dumps([study.fields, study.keep_diverged, [point.coords for point in study.points]])

    def datasets_of(self, w: Any) -> list[str]:
        """Datasets of an entry."""
        return [self.file(w.size, "studies", name) for name in self.entry(w.id, w.size).studies]

    def checks_of(self, w: Any) -> str:
        """Checks of an entry as JSON."""
        return json.dumps([asdict(check) for check in self.entry(w.id, w.size).checks])

    def measure_of(self, w: Any) -> str:
        """Hash of an entry's measure."""
        return sources(self.entry(w.id, w.size).measure, "studies")

    def figure_of(self, w: Any) -> str:
        """Hash of an entry's figure function."""
        return sources(self.entry(w.id, w.size).figure, "figures")

    def table_of(self, w: Any) -> str:
        """Hash of an entry's table function."""
        return sources(self.entry(w.id, w.size).table, "studies")

    def caption_of(self, w: Any) -> str:
        """Title and caption of an entry."""
        entry = self.entry(w.id, w.size)
        return f"**{entry.title}.** {entry.caption.strip()}"

    def chapter_of(self, w: Any) -> str:
        """Category of an entry in the report."""
        return f"Chapter {self.entry(w.id, w.size).chapter}"


@cache
def _solver(scene: bool) -> str:
    """Hash of the sources of a run, or of what a call without a scene may use of them."""
    return source_hash() if scene else source_hash("core", "bodies")


@cache
def sources(function: str, layer: str) -> str:
    """Hash of ``module.function`` of a layer: of the function with what it names in its module, and of the modules
    of that layer which this module imports. Of a function elsewhere (``package.module:function``), of its file."""
    place, _, name = function.rpartition(":") if ":" in function else function.rpartition(".")
    if ":" in function:
        spec = find_spec(place)
        return source_text(spec.origin) if spec and spec.origin else "missing"
    own = PACKAGE / layer / Path(*place.split(".")).with_suffix(".py")
    if not own.is_file():
        return "missing"
    layers = sorted(_reached(own) - {f"{layer}.{place}"})
    try:
        return source_hash(f"{layer}.{place}:{name}", *layers)
    except FileNotFoundError:
        return "missing"


def source_text(path: str) -> str:
    """Hash of a file outside the package."""
    tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()[:16]


def _reached(path: Path) -> set[str]:
    """Modules of studies/ and figures/ that a module imports, transitively, as ``studies.exact``."""
    found, waiting = set(), [path]
    while waiting:
        new = _imported(waiting.pop()) - found
        found |= new
        waiting += [PACKAGE.joinpath(*name.split(".")).with_suffix(".py") for name in new]
    return found


@cache
def _imported(path: Path) -> frozenset[str]:
    """Those that it imports itself; a file is read once."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("fsiwork."):
            continue
        base = node.module.removeprefix("fsiwork.")
        for name in (base, *(f"{base}.{alias.name}" for alias in node.names)):
            rooms = name.split(".")
            if rooms[0] in ("studies", "figures") and PACKAGE.joinpath(*rooms).with_suffix(".py").is_file():
                found.add(name)
    return frozenset(found)

"""YAML mappings from files, with faults of one line each."""

import re
from pathlib import Path
from typing import Any

import yaml

from fsiwork.specs.yaml import Quick

SIZES = ("coarse", "book")
FUNCTION = re.compile(r"([A-Za-z_][\w.]*:)?[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")
IDENTIFIER = re.compile(r"[A-Za-z]\w*")


class Faults(ValueError):
    """Everything that is wrong with the configuration, one line a fault."""

    def __init__(self, *lines: str):
        super().__init__("\n".join(lines))
        self.faults = list(lines)


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in a YAML file; `Faults` with the file's name when it is missing, broken or no mapping."""
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), Quick)
    except OSError as error:
        raise Faults(f"{path}: {error.strerror}") from None
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 0
        raise Faults(f"{path}: line {line}: {error.problem}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise Faults(f"{path}: {' '.join(str(error).split())}") from None
    if not isinstance(data, dict):
        raise Faults(f"{path}: must be a mapping")
    return data

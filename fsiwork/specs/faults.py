"""Faults: one line each, in the field's words, made from pydantic's error details."""

import difflib

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

FAULT = "fault"  # the one type of our own errors; their text is ready to be read
Fault = tuple[tuple[str | int, ...], str]  # path inside a spec, what is wrong there


def got(value: object) -> str:
    """A value as it can stand at the end of a one-line message."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, a list within itself
        text = f"something that cannot be printed ({type(value).__name__})"
    text = "".join(c if c.isprintable() else "?" for c in text)
    return text if len(text) <= 60 else text[:57] + "..."


def detail(path, text: str) -> dict:
    return {"type": PydanticCustomError(FAULT, "{text}", {"text": text}), "loc": tuple(path), "input": None}


def line(cls, found: dict) -> dict | None:
    """One of pydantic's errors in the field's words; None for those that only follow from another."""
    if found["type"] == "default_factory_not_called":
        return None
    text = wording(found)
    path = found["loc"]
    if found["type"] == "extra_forbidden":
        close = difflib.get_close_matches(str(path[-1]), cls.model_fields, n=1)
        text = (
            f"unknown key; did you mean {close[0]}?" if close else f"unknown key; known: {', '.join(cls.model_fields)}"
        )
    return detail(path, text)


def wording(found: dict) -> str:
    """The text of one of pydantic's error details, in the field's words."""
    kind, limits, value = found["type"], found.get("ctx", {}), found.get("input")
    if kind == FAULT:
        return found["msg"]
    if kind in ("missing", "default_factory_not_called"):
        return "is required"
    limit = limits.get("gt", limits.get("ge", limits.get("le")))
    words = {
        "greater_than": "must be positive" if limit == 0 else f"must be above {limit}",
        "greater_than_equal": "must not be negative" if limit == 0 else f"must be at least {limit}",
        "less_than_equal": f"must be at most {limit}",
        "finite_number": "must be finite",
        "literal_error": f"must be one of {limits.get('expected', '').replace(chr(39), '')}",
        "too_short": f"must have at least {limits.get('min_length')} items",
        "too_long": f"must have at most {limits.get('max_length')} items",
        "extra_forbidden": "unknown key",
        "recursion_loop": "refers to itself",
    }
    if kind in words:
        return f"{words[kind]}, got {got(value)}"
    for start, expected in (
        ("bool", "true or false"),
        ("float", "a number"),
        ("int", "a whole number"),
        ("tuple", "a list"),
        ("model", "a mapping"),
        ("dict", "a mapping"),
        ("string", "a text"),
    ):
        if kind.startswith(start):
            return f"must be {expected}, got {got(value)}"
    return "".join(c if c.isprintable() else " " for c in found["msg"])


def wrong(text: str, *path: str | int) -> ValidationError:
    """An error with one fault at ``path``, to be raised inside a validator."""
    return ValidationError.from_exception_data("scene", [detail(path, text)])

"""The common ground of all specs: frozen, unknown keys refused, and every fault at once, in one line each."""

import difflib
import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Annotated, Any, ClassVar, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    WrapValidator,
    model_validator,
)
from pydantic_core import PydanticCustomError

FAULT = "fault"  # the one type of our own errors; their text is ready to be read
LARGEST = 1e30  # beyond this a number is a slip, and products of a few of them would overflow

Fault = tuple[tuple[str | int, ...], str]  # path inside a spec, what is wrong there


def got(value: object) -> str:
    """A value as it can stand at the end of a one-line message."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, a list within itself
        text = f"a {type(value).__name__} that cannot be printed"
    text = "".join(c if c.isprintable() else "?" for c in text)
    return text if len(text) <= 60 else text[:57] + "..."


def _number(value: Any) -> Any:
    """Refuse what pydantic would read as a number though nobody meant one; huge integers in one line."""
    if isinstance(value, bool | bytes):
        raise PydanticCustomError(FAULT, "must be a number, got {got}", {"got": got(value)})
    if isinstance(value, int) and abs(value) > LARGEST:
        raise PydanticCustomError(FAULT, "is too large, got {got}", {"got": got(value)})
    return value


Number = Annotated[float, BeforeValidator(_number), Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, BeforeValidator(_number), Field(gt=0, le=LARGEST)]
NotNegative = Annotated[float, BeforeValidator(_number), Field(ge=0, le=LARGEST)]
Vector = Annotated[tuple[Number, ...], Field(max_length=3)]


def whole(low: int, high: int = 10**9):
    """The type of a whole number in [low, high]."""
    return Annotated[int, BeforeValidator(_number), Field(ge=low, le=high)]


def sense(*needs: str):
    """Mark a method as a check of physical sense, run when the fields ``needs`` are right by themselves.

    The method yields faults ``(path, text)``; paths count from its own spec.
    """

    def mark(method: Callable[[Any], Iterator[Fault]]):
        method.needs = needs
        return method

    return mark


class Spec(BaseModel):
    """A piece of a scene. All its faults are reported together, those between fields included."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, protected_namespaces=())
    piecewise: ClassVar[frozenset[str]] = frozenset()  # list fields whose sound items are checked beside faulty ones

    @model_validator(mode="wrap")
    @classmethod
    def _every_fault(cls, data, handler):
        if isinstance(data, cls):
            return handler(data)
        lines = []
        try:
            spec, sound = handler(data), set(cls.model_fields)
        except ValidationError as error:
            lines = [_line(cls, detail) for detail in error.errors(include_url=False)]
            lines = [line for line in lines if line]
            spec, sound = cls._sound_part(data, error)
        for check in _checks(cls):
            if sound.issuperset(check.needs):
                lines += [_detail(path, text) for path, text in check(spec)]
        if lines:
            raise ValidationError.from_exception_data(cls.__name__, lines)
        return spec

    @classmethod
    def _sound_part(cls, data: Any, error: ValidationError):
        """The fields that are right by themselves, as an unchecked spec, and their names."""
        if not isinstance(data, Mapping):
            return None, set()
        faulty = {detail["loc"][0] for detail in error.errors(include_url=False) if detail["loc"]}
        values = {}
        for name in set(cls.model_fields) & set(data):
            if name not in faulty:
                values[name] = _adapter(cls, name).validate_python(data[name])
            elif name in cls.piecewise and isinstance(data[name], list | tuple):
                values[name] = tuple(_item(cls, name, item) for item in data[name])
        defaults = {name for name, field in cls.model_fields.items() if not field.is_required()} - faulty - set(values)
        defaults = {name for name in defaults if cls.model_fields[name].default_factory is None}
        return cls.model_construct(**values), set(values) | defaults


@cache
def _checks(cls) -> tuple:
    found = (getattr(cls, name, None) for name in dir(cls) if not name.startswith("__"))
    return tuple(method for method in found if hasattr(method, "needs"))


@cache
def _adapter(cls, name: str) -> TypeAdapter:
    field = cls.model_fields[name]
    return TypeAdapter(Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation)


@cache
def _items(cls, name: str) -> TypeAdapter:
    return TypeAdapter(get_args(cls.model_fields[name].annotation)[0])


def _item(cls, name: str, value: Any):
    try:
        return _items(cls, name).validate_python(value)
    except ValidationError:
        return None


def _detail(path, text: str) -> dict:
    return {"type": PydanticCustomError(FAULT, "{text}", {"text": text}), "loc": tuple(path), "input": None}


def _line(cls, detail: dict) -> dict | None:
    """One of pydantic's errors in the field's words; None for those that only follow from another."""
    if detail["type"] == "default_factory_not_called":
        return None
    text = wording(detail)
    path = detail["loc"]
    if detail["type"] == "extra_forbidden":
        close = difflib.get_close_matches(str(path[-1]), cls.model_fields, n=1)
        text = (
            f"unknown key; did you mean {close[0]}?" if close else f"unknown key; known: {', '.join(cls.model_fields)}"
        )
    return _detail(path, text)


def wording(detail: dict) -> str:
    """The text of one of pydantic's error details, in the field's words."""
    kind, limits, value = detail["type"], detail.get("ctx", {}), detail.get("input")
    if kind == FAULT:
        return detail["msg"]
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
        ("float", "a number"),
        ("int", "a whole number"),
        ("tuple", "a list"),
        ("model", "a mapping"),
        ("dict", "a mapping"),
        ("string", "a text"),
    ):
        if kind.startswith(start):
            return f"must be {expected}, got {got(value)}"
    return "".join(c if c.isprintable() else " " for c in detail["msg"])


def wrong(text: str, *path: str | int) -> ValidationError:
    """An error with one fault at ``path``, to be raised inside a validator."""
    return ValidationError.from_exception_data("scene", [_detail(path, text)])


def one_of(*classes: type[Spec], short: bool = False):
    """The type of a field that takes one of several specs, told apart by their ``kind``.

    ``short``: the kind alone may stand for a spec without further keys (``edges: walls``). Paths of
    faults do not contain the kind.
    """

    def pick(value, _handler):
        if isinstance(value, classes):
            return value
        kinds = {kind: cls for cls in classes for kind in get_args(cls.model_fields["kind"].annotation)}
        if short and isinstance(value, str):
            value = {"kind": value}
        if not isinstance(value, Mapping):
            raise wrong(f"must be a mapping with a kind ({', '.join(kinds)}), got {got(value)}")
        if "kind" not in value:
            raise wrong(f"is required; one of {', '.join(kinds)}", "kind")
        kind = value["kind"]
        if not isinstance(kind, str) or kind not in kinds:
            raise wrong(f"must be one of {', '.join(kinds)}, got {got(kind)}", *(() if short else ("kind",)))
        return kinds[kind].model_validate(dict(value))

    union = classes[0]
    for cls in classes[1:]:
        union = union | cls
    kind = (Field(discriminator="kind"),) if len(classes) > 1 else ()
    return Annotated[(union, *kind, WrapValidator(pick))]


def finite(*values: float) -> bool:
    """Whether all values are finite numbers (quotients of extreme inputs need not be)."""
    return all(math.isfinite(value) for value in values)

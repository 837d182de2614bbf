"""The common ground of all specs: frozen, unknown keys refused, and every fault at once, in one line each."""

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, get_args, get_origin

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

from fsiwork.specs.faults import FAULT, Fault, detail, got, line, wrong

LARGEST = 1e30  # beyond this a number is a slip, and products of a few of them would overflow


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


def sense(method: Callable[[Any], Iterator[Fault]]):
    """Mark a method as a check of physical sense. It yields faults; their paths count from its own spec.

    On a spec that has faults already the method meets only the sound fields; the others are not there, and
    a check that asks for one ends (`tried`): that fault is reported anyway.
    """
    method.is_check = True
    return method


def tried(faults: Iterator[Fault]) -> Iterator[Fault]:
    """Faults up to the first look at a field that is itself faulty, and so not there."""
    try:
        yield from faults
    except Unsound:
        return


class Unsound(AttributeError):
    """A faulty field was asked for."""


class Nothing:
    """Stands for an item of a list of which nothing is sound."""

    def __getattr__(self, name):
        raise Unsound(name)


class Spec(BaseModel):
    """A piece of a scene. All its faults are reported together, those between fields included."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, protected_namespaces=())
    divisible: ClassVar[bool] = True  # whether the sound fields of a faulty one are of use to checks further up

    @model_validator(mode="wrap")
    @classmethod
    def _every_fault(cls, data, handler):
        if isinstance(data, cls):
            return handler(data)
        lines = []
        try:
            spec = handler(data)
        except ValidationError as error:
            details = error.errors(include_url=False)
            lines = [fault for found in details if (fault := line(cls, found))]
            spec = cls._sound_part(data, {found["loc"][0] for found in details if found["loc"]})
        for check in _checks(cls):
            lines += [detail(path, text) for path, text in tried(check(spec))]
        if lines:
            raise ValidationError.from_exception_data(cls.__name__, lines)
        return spec

    @classmethod
    def _sound_part(cls, data: Any, faulty: set):
        """An unchecked spec without the faulty fields; of those that are specs, their sound part."""
        if not isinstance(data, Mapping):
            return Nothing()
        values = {name: _sound(cls, name, data[name], name in faulty) for name in set(cls.model_fields) & set(data)}
        for name, field in cls.model_fields.items():
            if name not in values:
                values[name] = ABSENT if name in faulty or field.is_required() else _default(field, values)
        part = cls.model_construct(**values)
        for name in [name for name, value in values.items() if value is ABSENT]:
            del part.__dict__[name]
        return part

    def __getattr__(self, name):
        """Only asked for what is not there."""
        if name in type(self).model_fields or isinstance(getattr(type(self), name, None), property):
            raise Unsound(name)
        return super().__getattr__(name)


ABSENT = object()


def _default(field, values: dict):
    """The default of a field; ABSENT when it is made from a field that is not there."""
    made_from = {name: value for name, value in values.items() if value is not ABSENT}
    try:
        return field.get_default(call_default_factory=True, validated_data=made_from)
    except KeyError:
        return ABSENT


@cache
def _checks(cls) -> tuple:
    found = (getattr(cls, name, None) for name in dir(cls) if not name.startswith("__"))
    return tuple(method for method in found if hasattr(method, "is_check"))


@cache
def _adapter(cls, name: str) -> TypeAdapter:
    field = cls.model_fields[name]
    return TypeAdapter(Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation)


def _sound(cls, name: str, value: Any, faulty: bool):
    """The value of a field as far as it is sound, or ABSENT."""
    if not faulty:
        return _adapter(cls, name).validate_python(value)
    field = cls.model_fields[name]
    return _part(field.annotation, field.metadata, value)


def _part(annotation, metadata, value):
    """What is sound of a faulty value."""
    if picks := [m.func for m in metadata if isinstance(m, WrapValidator) and isinstance(m.func, _Pick)]:
        annotation = picks[0].choose(value)
    if get_origin(annotation) is Annotated:
        inner, *more = get_args(annotation)
        return _part(inner, more, value)
    if get_origin(annotation) is tuple and isinstance(value, list | tuple):
        item, *rest = get_args(annotation)
        specs = rest == [...] and any(isinstance(m, WrapValidator) for m in getattr(item, "__metadata__", ()))
        return tuple(_item(item, each) for each in value) if specs else ABSENT
    for cls in (annotation, *get_args(annotation)):
        if isinstance(cls, type) and issubclass(cls, Spec) and cls.divisible and isinstance(value, Mapping):
            faulty = _faulty(cls, value)
            return ABSENT if None in faulty else cls._sound_part(value, faulty)
    return ABSENT


def _faulty(cls, value) -> set:
    """Names of the faulty fields; None stands for a fault of the whole."""
    try:
        cls.model_validate(value)
    except ValidationError as error:
        return {found["loc"][0] if found["loc"] else None for found in error.errors(include_url=False)}
    return set()


def _item(annotation, value):
    try:
        return TypeAdapter(annotation).validate_python(value)
    except ValidationError:
        part = _part(annotation, (), value)
        return Nothing() if part is ABSENT else part


class _Pick:
    """Chooses among specs by their ``kind``."""

    def __init__(self, classes: tuple[type[Spec], ...], short: bool):
        self.classes, self.short = classes, short

    @property
    def kinds(self) -> dict[str, type[Spec]]:
        return {kind: cls for cls in self.classes for kind in get_args(cls.model_fields["kind"].annotation)}

    def choose(self, value):
        """The class that a mapping names, or None."""
        kind = value.get("kind") if isinstance(value, Mapping) else None
        return self.kinds.get(kind) if isinstance(kind, str) else None

    def __call__(self, value, _handler):
        if isinstance(value, self.classes):
            return value
        names = ", ".join(self.kinds)
        if self.short and isinstance(value, str):
            value = {"kind": value}
        if not isinstance(value, Mapping):
            raise wrong(f"must be a mapping with a kind ({names}), got {got(value)}")
        if "kind" not in value:
            raise wrong(f"is required; one of {names}", "kind")
        chosen = self.choose(value)
        if chosen is None:
            raise wrong(f"must be one of {names}, got {got(value['kind'])}", *(() if self.short else ("kind",)))
        return chosen.model_validate(dict(value))


def one_of(*classes: type[Spec], short: bool = False):
    """The type of a field that takes one of several specs, told apart by their ``kind``.

    ``short``: the kind alone may stand for a spec without further keys (``edges: walls``). Paths of
    faults do not contain the kind.
    """

    union = classes[0]
    for cls in classes[1:]:
        union = union | cls
    kind = (Field(discriminator="kind"),) if len(classes) > 1 else ()
    pick = _Pick(classes, short)
    if short:
        alone = Literal[tuple(pick.kinds)]
        return Annotated[(union, *kind, WrapValidator(pick, json_schema_input_type=union | alone))]
    return Annotated[(union, *kind, WrapValidator(pick))]


def finite(*values: float) -> bool:
    """Whether all values are finite numbers (quotients of extreme inputs need not be)."""
    return all(math.isfinite(value) for value in values)

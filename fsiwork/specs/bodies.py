"""Bodies: elastic membranes, drops and bubbles, with their energy laws and numerical choices."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal, Protocol, runtime_checkable

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, TypeAdapter, WrapValidator
from pydantic_core import core_schema

from fsiwork.specs.base import NotNegative, Number, Positive, Spec, one_of, sense, whole
from fsiwork.specs.faults import Fault, got, wrong
from fsiwork.specs.fluid import Inside
from fsiwork.specs.lines import Fibre, Ring
from fsiwork.specs.shapes import SHAPES, Ball, Shape


class Quadratic(Spec):
    """E(s) = ½ λ (s − 1)² per rest area (3.13): a membrane. ``stiffness`` is λ."""

    kind: Literal["quadratic"] = "quadratic"
    stiffness: Positive


class Linear(Spec):
    """E(s) = λ s per rest area: a drop. ``stiffness`` is λ, the surface tension."""

    kind: Literal["linear"] = "linear"
    stiffness: Positive


@runtime_checkable
class Law(Protocol):
    """Any energy E(s) per rest area, s the stretch, with two derivatives; arrays in, arrays out. Python only."""

    def E(self, s: Any) -> Any:
        """Energy."""

    def dE(self, s: Any) -> Any:
        """Its first derivative."""

    def ddE(self, s: Any) -> Any:
        """Its second derivative."""


class _LawInPython:
    """How pydantic sees a `Law`: kept as it is, written as a name that cannot be read back."""

    @classmethod
    def __get_pydantic_core_schema__(cls, _source, _handler: GetCoreSchemaHandler):
        def name(law):
            return {"kind": "python", "name": f"{type(law).__module__}.{type(law).__qualname__}"}

        return core_schema.is_instance_schema(Law, serialization=core_schema.plain_serializer_function_ser_schema(name))

    @classmethod
    def __get_pydantic_json_schema__(cls, _schema, _handler: GetJsonSchemaHandler):
        return {"not": {}}


_written = TypeAdapter(one_of(Quadratic, Linear))


def _law(value, _handler):
    if isinstance(value, Law):
        return value
    if isinstance(value, dict) and value.get("kind") == "python":
        raise wrong(f"the law {got(value.get('name'))} was written in Python and must be given there")
    return _written.validate_python(value)


Energy = Annotated[Quadratic | Linear | Annotated[Law, _LawInPython], WrapValidator(_law)]


class Width(Spec):
    """ε, the half-width of the smeared interface: in cells, or as a length that refinement keeps."""

    cells: Positive | None = None
    length: Positive | None = None

    @sense
    def _one(self) -> Iterator[Fault]:
        if (self.cells is None) == (self.length is None):
            yield (), f"give either cells or length, got {'both' if self.cells else 'neither'}"

    def of(self, h: float) -> float:
        """ε [length] for cells of side ``h``."""
        return self.length if self.cells is None else self.cells * h


class Transport(Spec):
    """How the interface is carried: φ itself (field) or the backward map Y with φ = φ₀(Y) (map).

    ``band``: only so many cells on either side of it; φ is clipped beyond. ``from_interface``: with the velocity of the
    nearest point of the interface, which keeps a distance a distance (1.5.1). ``restart``: of a membrane's map; as soon
    as |∂_jY_i| near the interface exceeds this, φ₀ ← φ and Y ← x.
    """

    scheme: Literal[
        "weno5", "weno-z", "upwind5", "upwind1", "centred", "eno2", "eno3",
        "lax-wendroff", "beam-warming", "fromm", "semi-lagrangian",
    ] = "weno5"  # fmt: skip
    band: Annotated[float, Field(ge=3)] | None = None
    from_interface: bool = False
    tableau: Literal["ssp-rk3", "ssp-rk2", "euler"] = "ssp-rk3"
    carry: Literal["field", "map"] = "field"
    restart: Annotated[Positive, Field(gt=1)] | None = None
    dtype: Literal["float64", "float32"] = "float64"

    @sense
    def _band_of_a_field(self) -> Iterator[Fault]:
        if self.band and self.carry == "map":
            yield ("band",), "is for carry: field; a map is needed everywhere"

    @sense
    def _restart_of_a_map(self) -> Iterator[Fault]:
        if self.restart and self.carry == "field":
            yield ("restart",), "is for carry: map"

    @sense
    def _interface_of_a_field(self) -> Iterator[Fault]:
        staged = ("weno5", "weno-z", "upwind5", "upwind1", "centred", "eno2", "eno3")
        if self.from_interface and (self.carry == "map" or self.scheme not in staged):
            yield ("from_interface",), f"is for carry: field and a Runge-Kutta scheme, one of {', '.join(staged)}"


class Membrane(Spec):
    """An elastic interface that reacts to its change of area (Chapter 3); with a linear law, a drop.

    ``stretch`` is |∇φ₀|, the first ratio of current to rest area; ``surface_mass`` is per rest area; ``bending`` is the
    modulus k of the energy ½kH². ``form`` and ``dirac`` are chosen by the law unless an expert overrides them. After
    ``renew`` steps, or restarts of a map (0: never), the lines φ = c beside the interface are drawn anew, at the
    distance to it times its stretch: for membranes and drops that tank-tread.
    """

    kind: Literal["membrane"] = "membrane"
    shape: Shape
    stretch: Positive = 1.0
    energy: Energy
    width: Width
    coupling: Literal["explicit", "semi-implicit", "stabilised", "iterated"] = "semi-implicit"
    form: Literal["auto", "normal-tangential", "divergence", "split", "korteweg", "adjoint"] = "auto"
    dirac: Literal["auto", "plain", "renormalised"] = "auto"
    inside: Inside | None = None
    surface_mass: NotNegative = 0.0
    bending: NotNegative = 0.0
    renew: whole(0) = 0
    transport: Transport = Transport()

    @sense
    def _bending_fits(self) -> Iterator[Fault]:
        if self.transport.band:
            yield ("transport", "band"), "is for kind: interface; a membrane's |∇φ| is its stretch"
        if self.transport.from_interface:
            yield ("transport", "from_interface"), "is for bodies of kind interface"
        own = self.transport
        if self.form == "adjoint" and (own.scheme, own.carry, own.dtype) != ("upwind5", "field", "float64"):
            yield ("form",), "adjoint needs transport.scheme: upwind5, whose derivative is linear, of a float64 field"
        if self.renew and self.transport.carry == "map" and not self.transport.restart:
            yield ("renew",), "is for transport.carry: field; a map makes φ anew each step, unless it has a restart"
        if self.bending and self.coupling == "iterated":
            yield ("coupling",), "with bending it must be explicit, semi-implicit or stabilised, got 'iterated'"
        if self.bending and self.coupling == "stabilised" and self.surface_mass:
            yield ("coupling",), "with bending and a surface mass it must be explicit, got 'stabilised'"


class Bubble(Spec):
    """One of several bubbles: either its density, or in a Boussinesq fluid its buoyancy (ρ₀ − ρ)/ρ₀."""

    shape: Shape
    density: Positive | None = None
    buoyancy: Number | None = None

    @sense
    def _one(self) -> Iterator[Fault]:
        if (self.density is None) == (self.buoyancy is None):
            yield (), f"give either density or buoyancy, got {'neither' if self.density is None else 'both'}"


class Bubbles(Spec):
    """Bubbles and drops in one level set, so that they merge; each carries its density with it (1.32)–(1.34).

    ``film`` is the thickness below which a film between two of them breaks; 0: below one or two cells, by chance of the
    grid. ``keep_volume``: φ is shifted to keep their volume together, from which transport swallows thin films.
    ``tension`` is λ, 0 for none; ``viscosity`` belongs to the densities and counts inside all of the bubbles.
    """

    stretch: ClassVar = 1.0
    form: ClassVar = "auto"
    surface_mass: ClassVar = 0.0

    kind: Literal["bubbles"] = "bubbles"
    parts: Annotated[tuple[Bubble, ...], Field(min_length=1, max_length=1000)]
    tension: NotNegative = 0.0
    film: NotNegative = 0.0
    keep_volume: bool = False
    viscosity: NotNegative | None = None
    width: Width
    coupling: Literal["explicit", "semi-implicit", "stabilised", "iterated"] = "explicit"
    transport: Transport = Transport()

    @property
    def boussinesq(self) -> bool:
        """Whether the bubbles have a buoyancy in place of a density."""
        return self.parts[0].density is None

    @property
    def energy(self) -> Linear:
        """Surface tension as a law; its stiffness may be 0 here."""
        return Linear.model_construct(stiffness=self.tension)

    @property
    def inside(self) -> Inside | None:
        """The lightest of the fluids inside; nothing for bubbles with a buoyancy."""
        if self.boussinesq:
            return None
        return Inside(density=min(part.density for part in self.parts), viscosity=self.viscosity)

    @sense
    def _alike(self) -> Iterator[Fault]:
        for k, part in enumerate(self.parts):
            if (part.density is None) != self.boussinesq:
                yield ("parts", k), "all bubbles have a density, or all a buoyancy"
        if self.boussinesq and self.viscosity is not None:
            yield ("viscosity",), "bubbles with a buoyancy have the viscosity of the fluid"
        if self.transport.band:
            yield ("transport", "band"), "is for kind: interface"
        if self.transport.from_interface:
            yield ("transport", "from_interface"), "is for bodies of kind interface"
        if self.transport.restart:
            yield ("transport", "restart"), "is for bodies of kind membrane"
        for name in ("film", "keep_volume"):
            if getattr(self, name) and self.transport.carry == "map":
                yield (name,), "needs transport.carry: field"
        if not self.boussinesq and self.viscosity is None:
            yield ("viscosity",), "is required for bubbles with a density"


class Redistance(Spec):
    """φ becomes a distance again by a ``method`` of `fsiwork.core.redistance`, after ``every`` so many steps."""

    method: Literal[
        "pde",
        "subcell",
        "fast-marching-1",
        "fast-marching-2",
        "fast-sweeping",
        "closest-cubic",
        "closest-quintic",
        "sweep",
    ]
    every: whole(1) = 1


class Interface(Spec):
    """An interface that goes with the flow and does nothing to it: a level set or a backward map."""

    kind: Literal["interface"] = "interface"
    shape: Shape
    transport: Transport = Transport()
    redistance: Redistance | None = None

    @sense
    def _field_to_redistance(self) -> Iterator[Fault]:
        if self.redistance and self.transport.carry == "map":
            yield ("redistance",), "is for transport.carry: field; a map makes φ anew each step"
        if self.transport.restart:
            yield ("transport", "restart"), "is for bodies of kind membrane"


class Markers(Spec):
    """The same elastic line by Lagrangian markers: the immersed boundary method (3.1)-(3.8), in the plane or a ring.

    A shape in the plane must be star-shaped seen from the middle of its bounds; the markers lie ``spacing`` cells apart
    at first.
    """

    kind: Literal["markers"] = "markers"
    shape: one_of(*SHAPES, Ring)
    stretch: Positive = 1.0
    energy: Energy
    spacing: Positive = 0.5


class Curve(Spec):
    """An elastic curve in space (3.4), where two level sets meet; ``energy`` is per rest length, its slope a force.

    ``stretch`` is |∇φ¹ × ∇φ²| at first, shared by both fields: the tube around the curve is 2ε/√stretch wide.
    """

    kind: Literal["curve"] = "curve"
    shape: one_of(Ring, Fibre)
    stretch: Positive = 1.0
    energy: Energy
    width: Width
    coupling: Literal["explicit", "stabilised"] = "explicit"
    transport: Transport = Transport()

    @sense
    def _whole_field(self) -> Iterator[Fault]:
        if self.transport.band:
            yield ("transport", "band"), "is for kind: interface; |∇φ¹ × ∇φ²| is the stretch of a curve"
        if self.transport.from_interface:
            yield ("transport", "from_interface"), "is for bodies of kind interface"
        if self.transport.restart:
            yield ("transport", "restart"), "is for bodies of kind membrane"


class ShearMembrane(Spec):
    """A sphere that reacts to its change of area and to shear (3.3), carried by the backward map.

    ``law``: quadratic (3.65), linear (E₂' = λ₂), neo-hookean or skalak, see `fsiwork.bodies.shear`; ``area`` and
    ``shear`` are λ₁ and λ₂, ``volume`` a modulus that holds det ∇Y, ``slip`` one that holds the layers of the band
    together. The shape is that at t = 0,
    ``inflation`` its radius over that at rest, ``twist`` t₀ of (3.67),
    which ``alike`` continues off the sphere so that all layers of the band are strained alike. ``coupling: stabilised``
    allows steps beyond the explicit limit, at a loss of accuracy.
    """

    stretch: ClassVar = 1.0
    inside: ClassVar = None
    transport: ClassVar = Transport(scheme="upwind5", carry="map")

    kind: Literal["shear-membrane"] = "shear-membrane"
    shape: one_of(Ball)
    law: Literal["quadratic", "linear", "neo-hookean", "skalak"] = "quadratic"
    area: NotNegative = 0.0
    shear: Positive
    volume: NotNegative = 0.0
    slip: NotNegative = 0.0
    width: Width
    coupling: Literal["explicit", "stabilised"] = "explicit"
    twist: Number = 0.0
    inflation: Positive = 1.0
    alike: bool = False

    @sense
    def _law_fits(self) -> Iterator[Fault]:
        if self.law == "neo-hookean" and self.area:
            yield ("area",), f"a neo-hookean membrane has the modulus shear alone, got {self.area}"

    def misfits(self, dim: int, kinds: set[str]) -> Iterator[Fault]:
        """What does not fit a box of so many directions with sides of these kinds."""
        if dim != 3:
            yield ("kind",), f"shear-membrane is for three directions, the box has {dim}"
        for name, rest in (("twist", 0.0), ("inflation", 1.0)):
            if getattr(self, name) != rest and "periodic" in kinds:
                yield (name,), "needs a box without periodic sides: Y is not periodic"


Body = one_of(Membrane, Bubbles, Interface, Markers, Curve, ShearMembrane)

"""Bubbles and drops in one φ, so that they merge, each with its own density or buoyancy (1.32)-(1.34)."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from fsiwork.bodies.laws import Linear
from fsiwork.bodies.membrane import Membrane
from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.integrals import area_and_volume, length_and_area
from fsiwork.core.levelset import dirac, heaviside
from fsiwork.core.transport import Transport

TINY = 1e-300


class Bubbles(Membrane):
    """Several bodies of fluid inside one interface φ = 0; what each brings goes with the flow.

    The density inside, or the buoyancy, is at first that of the nearest bubble. The seams where two of them meet, zeros
    of the differences of the distances, are carried like φ; with a map the bubble is looked up at Y. So density never
    diffuses, and where bubbles have merged it jumps from cell to cell.

    Parameters
    ----------
    grid, edges, transport, eps, coupling, carry : as in `Membrane`
    shapes : the distances [length] of the bubbles
    values : one number a bubble: its density, or with ``boussinesq`` its buoyancy (ρ₀ - ρ)/ρ₀, any real number
    tension : surface tension λ ≥ 0 [force/length]; 0: the interface pulls nowhere
    boussinesq : inertia is that of the fluid, and gravity pulls (ρ - ρ₀)g = -buoyancy ρ₀ g inside
    film : thickness [length] below which a film between two pieces breaks: so two bubbles merge at a time that does not
        depend on the grid. 0: φ alone decides, which merges them when the film is one or two cells thick
    keep_volume : after every step φ is shifted so that the volume of φ < 0 is what it was at first. For thin films,
        whose fluid the bubbles swallow once a film is thinner than a cell
    viscosity : inside all of them; belongs to the densities, None with ``boussinesq``

    Attributes
    ----------
    content : flat field of the density or buoyancy that counts where φ < 0
    seams : flat fields, distance to the bubbles of one value less that to those of the first, a field for each further
        value; none with a map

    Raises
    ------
    ValueError : not one value for every shape; a viscosity without a density or the reverse; ``film`` or
        ``keep_volume`` with a map, which keeps its own shape
    """

    def __init__(
        self,
        grid: Grid,
        edges: Edges,
        shapes: Sequence[Callable],
        values: Sequence[float],
        eps: float,
        *,
        transport: Transport,
        tension: float = 0.0,
        boussinesq: bool = False,
        viscosity: float | None = None,
        film: float = 0.0,
        keep_volume: bool = False,
        coupling: str = "explicit",
        carry: str = "field",
    ):
        if len(shapes) != len(values) or not values:
            raise ValueError(f"one value for every bubble: got {len(values)} for {len(shapes)}")
        if boussinesq != (viscosity is None):
            raise ValueError("bubbles with a density have a viscosity too, those with a buoyancy that of the fluid")
        if carry == "map" and (film or keep_volume):
            raise ValueError("only a field can be changed to break films or to keep the volume, not a map")
        self.shapes, self.values = tuple(shapes), np.array(values, float)
        self.boussinesq, self.tension, self.film = boussinesq, float(tension), float(film)
        inside = None if boussinesq else (float(self.values.min()), viscosity)
        super().__init__(
            grid, edges, self._union, Linear(self.tension), eps,
            transport=transport, coupling=coupling, carry=carry, inside=inside,
        )  # fmt: skip
        self.content = grid.field(transport.dtype)
        self.seams: list[np.ndarray] = []
        self._kinds, self._kind = np.unique(self.values, return_inverse=True)
        if self.map:
            self._look_up(self.map.home())
        else:
            first, *others = self._distances(grid.points())
            self.seams = [(q - first).astype(transport.dtype).ravel() for q in others]
            self._choose()
        self._volume = self.volume() if keep_volume else None

    # --- verbs ------------------------------------------------------------------------------------------------
    def blend(self, flow, dt: float) -> None:
        """ρ = ρ₁ + (content - ρ₁)(1 - H_ε) and μ likewise; nothing for Boussinesq bubbles."""
        if self.boussinesq:
            return
        rho = flow.mixture("rho")
        rho += (self.content - rho) * self._share()
        self.edges.fill_scalar(rho, "mirror")
        if self.inside[1] != flow.viscosity:
            self._mix(flow.mixture("mu"), self.inside[1], 0.0)

    def push(self, flow, dt: float) -> None:
        """Add surface tension, and the buoyancy -content ρ₀ g (1 - H_ε) to ``flow.force``."""
        if self.tension:
            super().push(flow, dt)
        if self.boussinesq and any(flow.gravity):
            lift = self.content * self._share()
            for a, s in enumerate(self.grid.strides):
                if flow.gravity[a]:
                    flow.force[a][s:] -= 0.5 * flow.density * flow.gravity[a] * (lift[s:] + lift[:-s])

    def move(self, flow, dt: float) -> None:
        """Carry φ and the seams, or Y; break films and keep the volume."""
        super().move(flow, dt)
        if self.map:
            self._look_up(self.map.home())
        elif self.seams:
            self.transport.advance(self.seams, flow.u, dt, "linear")
            self._choose()
        if self.film:
            self._break_films()
        if self._volume is not None:
            self._restore_volume()

    # --- answers ----------------------------------------------------------------------------------------------
    def gauges(self, flow) -> dict[str, float]:
        """Those of `Membrane`, its volume by `volume`; ``pieces``; ``content``: mean density or buoyancy inside."""
        share = self._share()
        content = self._sum(share * self.content) / (self._sum(share) or np.nan)
        own = {"volume": self.volume(), "pieces": float(self.pieces()), "content": content}
        return super().gauges(flow) | own

    def volume(self) -> float:
        """Volume (2D: area) of φ < 0 by heights [length^d], not that of the smeared indicator."""
        measure = length_and_area if self.grid.dim == 2 else area_and_volume
        return measure(self.grid, self.phi)[1]

    def pieces(self) -> int:
        """Number of sets of cells with φ < 0 that are connected through faces, across periodic sides too."""
        return np.unique(self._pieces()).size - 1

    def _pieces(self) -> np.ndarray:
        """Number of the piece of every cell, 0 outside; interior array."""
        label, count = ndimage.label(self.grid.inside(self.phi) < 0.0)
        name = np.arange(count + 1)
        for a in self.grid.axes:
            ends = label.take(0, a).ravel(), label.take(-1, a).ravel()
            for low, high in set(zip(*ends, strict=True)) if self.edges.periodic(a) else ():
                if low and high:
                    name[name == name[high]] = name[low]
        return name[label]

    # --- parts ------------------------------------------------------------------------------------------------
    def _union(self, *x):
        return np.minimum.reduce(np.broadcast_arrays(*(distance(*x) for distance in self.shapes)))

    def _restore_volume(self):
        """Shift φ by (V - V₀)/∫D_ε(φ), half a cell at most: a Newton step a time step."""
        surface, h = self._sum(dirac(self.phi, self.eps)), self.grid.h
        if surface:
            self.phi += np.clip((self.volume() - self._volume) / surface, -0.5 * h, 0.5 * h)

    def _break_films(self):
        """Where two pieces come nearer than ``film``, join them by a ball half as wide again; not across the sides."""
        piece = self._pieces()
        if piece.max() <= piece[piece > 0].min(initial=piece.max()):
            return
        g = self.grid
        rim = (piece > 0) & ndimage.maximum_filter(piece == 0, footprint=ndimage.generate_binary_structure(g.dim, 1))
        name, foot = piece[rim], self._feet(rim)
        for k in np.unique(name)[1:]:
            one, other = foot[name == k], foot[name != k]
            gap, nearest = cKDTree(other).query(one)
            if gap.min() < self.film:
                i = int(gap.argmin())
                middle = 0.5 * (one[i] + other[nearest[i]])
                ball = np.sqrt(sum((x - c) ** 2 for x, c in zip(g.points(), middle, strict=True))) - 0.75 * self.film
                padded = g.padded(self.phi)
                np.minimum(padded, ball, out=padded)
                self.edges.fill_scalar(self.phi, "linear")

    def _feet(self, rim: np.ndarray) -> np.ndarray:
        """Points x - φ∇φ/|∇φ|² of the interface next to the cells of a mask, shape (cells, directions)."""
        g = self.grid
        phi, cells = g.padded(self.phi), np.nonzero(rim)
        here = tuple(c + GHOSTS for c in cells)
        slope = np.empty((cells[0].size, g.dim))
        for a in g.axes:
            e, w = (tuple(c + k * (b == a) for b, c in enumerate(here)) for k in (1, -1))
            slope[:, a] = 0.5 * (phi[e] - phi[w]) / g.h
        x = np.stack([g.coordinate(a)[c] for a, c in enumerate(cells)], -1)
        return x - (phi[here] / np.maximum((slope**2).sum(1), TINY))[:, None] * slope

    def _distances(self, x) -> list[np.ndarray]:
        """Distances to the bubbles of each value."""
        found = np.broadcast_arrays(*(distance(*x) for distance in self.shapes))
        return [
            np.minimum.reduce([q for q, k in zip(found, self._kind, strict=True) if k == j])
            for j in range(self._kinds.size)
        ]

    def _look_up(self, x):
        self.grid.padded(self.content)[...] = self._kinds[np.argmin(self._distances(x), axis=0)]
        self.edges.fill_scalar(self.content, "mirror")

    def _choose(self):
        self.content[:] = self._kinds[np.argmin([np.zeros_like(self.phi), *self.seams], axis=0)]

    def _sum(self, q: np.ndarray) -> float:
        """∫q over the box."""
        return float(self.grid.inside(q).sum()) * self.grid.cell_volume

    def _share(self) -> np.ndarray:
        """1 - H_ε(φ), flat."""
        return 1.0 - heaviside(self.phi, self.eps)

    def _named(self) -> dict[str, np.ndarray]:
        seams = {f"seam_{k}": q for k, q in enumerate(self.seams, 1)}
        return super()._named() | {"content": self.content} | seams

"""What solutions show: pages of HTML, extremes of fields, files, pictures."""

import base64
import html
import io
import platform
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..beam import Beam, Domain, Layout, WhichMember
from ..core import (AncfError, Array, CallbackError, InputError, StrPath, output_file, require_flag,
                    require_integer, require_path, require_text)
from ..io import save_vtu, to_xarray
from ..recovery.fields import DRAWN, find_field, no_value, unit_in, units_of, values_on_grid
from ..recovery.grids import layout, values_of_domain
from ..visuals import diagrams, matplotlib, pyvista
from ..visuals.diagrams import KINDS, ROOM, lines_of
from ..visuals.matplotlib import dress, new_axes, plot_scene
from ..visuals.scenery import rounded, symbols_of, unit_of_load
from .checks import has_strength, materials_of

#: Resolution of pictures in notebooks, in dots per inch.
SCREEN = 80


def picture(draw: Callable[[], Any], dpi: int = SCREEN) -> str:
    """An img element of the figure of ``draw()``; empty if that fails."""
    try:
        figure, data = draw().figure, io.BytesIO()
        figure.savefig(data, format="png", dpi=dpi, bbox_inches="tight")
    except AncfError:
        return ""
    return f'<img src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}"/>'


def words(text: str) -> str:
    """A text in HTML as it is."""
    return f"<pre>{html.escape(text)}</pre>"


def scene_html(scene: Any) -> str:
    """A table of the items of a Scene, and its reference configuration."""
    things = {"beam": scene.beams, "rigid body": scene.bodies, "domain": scene.domains,
              "item": scene.items}
    texts = [(kind, " ".join(repr(one).split())) for kind, some in things.items() for one in some]
    table = "".join(f"<tr><td>{kind}</td><td>" + html.escape(
        text if len(text) <= 160 else text[:157] + "...") + "</td></tr>" for kind, text in texts)
    return (words(repr(scene)[1:-1]) + f"<table>{table}</table>"
            + picture(lambda: scene.state().plot("displacement", colorbar=False, title="",
                                                  cmap="Greys")))


def history_html(history: Any) -> str:
    """The text of a History, and its energies over time."""
    return words(repr(history)[1:-1]) + (
        picture(lambda: history_picture(history)) if len(history) > 1 else "")


def history_picture(history: Any) -> Any:
    """Axes with the energies of a History over time."""
    ax = new_axes((5.5, 3.0))
    for name in ("strain", "kinetic", "potential", "total"):
        ax.plot(history.t, getattr(history, f"{name}_energy"), lw=1.4, label=name)
    ax.legend(fontsize=8, frameon=False)
    dress(ax, "energy", "time", "")
    return ax


#: Fields whose largest values are listed, with their units.
LISTED = {"displacement": "length", "S_xx": "force / area", "von_mises": "force / area",
          "utilisation": ""}
#: Rows of a table at most; instants of a motion that are compared.
ROWS, INSTANTS = 40, 50
#: Sum of all forces over the largest of them in an equilibrium.
BALANCED = 1e-5
#: Forces that are round-off, relative to the bending stiffness over the squared size.
NO_FORCE = 1e-9
#: Decimals of coordinates; section forces relative to the largest of their kind that are zero.
ROUNDED, ZERO = 12, 1e-12
#: Resolution of the pictures, in dots per inch.
DPI = 110

STYLE = """
@page { size: A4; margin: 15mm }
body { font: 10pt/1.4 "Helvetica Neue", Arial, sans-serif; color: #222; max-width: 180mm;
       margin: 10mm auto; padding: 0 4mm }
h1 { font-size: 17pt; margin: 0 } h2 { font-size: 12pt; margin: 6mm 0 1mm; color: #1f5f8b }
p { margin: 1mm 0 } .note { color: #666; font-size: 9pt }
table { border-collapse: collapse; margin: 2mm 0; font-size: 9pt; break-inside: avoid }
td, th { border-bottom: 1px solid #ccc; padding: 0.6mm 3mm 0.6mm 0; text-align: left;
         vertical-align: top }
th { border-bottom: 1.5px solid #222 } td.number { text-align: right; white-space: nowrap }
img { max-width: 100%; max-height: 68mm; display: block; margin: 2mm auto }
h2 { break-after: avoid } h2, figure { break-inside: avoid } figure { margin: 0 }
.tall img { max-height: 160mm }
.bad { color: #b3261e }
@media print { body { margin: 0; padding: 0; max-width: none } }
"""


def report(state: Any, filename: StrPath, title: str | None = None) -> Path:
    """Write a page of HTML about the solution: to read, to print, to send; returns its path.

    The page contains the pictures and needs no other file. It has the model with its sizes,
    materials, loads and supports; reactions and their balance; extremes of displacement, stress,
    utilisation and section forces, and where they are; diagrams; findings, and versions. Units are
    those of :meth:`Scene.units <skfem_ancf.Scene.units>`. Printed it is two to four A4 pages.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.State`.
    filename
        Ends with .html; missing folders are created.
    title
        Title of the page; by default the name of the file.

    Examples
    --------
    >>> from skfem_ancf import Frame, StVenantKirchhoff
    >>> steel = StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850, strength=235e6)
    >>> frame = Frame.from_lines([(0, 0), (4, 0)], [(0, 1)], material=steel, height=0.2, width=0.1)
    >>> state = frame.units("N", "m").pin(0).hold(1, "y").line_load((0, -1e4)).solve_static()
    >>> state.report("girder.html").name  # doctest: +SKIP
    'girder.html'
    """
    return _written(filename, title, lambda: _Page(state).parts())


def report_of_history(history: Any, filename: StrPath, title: str | None = None) -> Path:
    """Write a page of HTML about a motion or run: :meth:`State.report
    <skfem_ancf.State.report>` of its instant of largest utilisation, or displacement; returns its
    path.

    It begins with the energies and sensors over time.

    Parameters
    ----------
    history
        A :class:`~skfem_ancf.History`.
    filename, title
        As for a State.
    """
    def parts():
        n = len(history)
        chosen = np.unique(np.linspace(0, n - 1, min(n, INSTANTS)).astype(int))
        states = list(history.states(chosen.tolist()))
        by = "utilisation" if has_strength(states[0]) else "displacement"
        state = max(states, key=lambda one: one.extremes(by, 1)[0].value)
        yield "<h2>Motion</h2>"
        yield _text(f"t = {history.t[0]:g} to {history.t[-1]:g}, {history.steps} steps by "
                    f"{history.scheme!r}. What follows is the instant t = {state.t:g}, of the "
                    f"largest {by} of {len(chosen)} instants.")
        yield _figure(lambda: history_picture(history))
        for name, values in history.sensors.items():
            if values.ndim == 1:
                yield _figure(partial(history.plot_curve, "t", name, xlabel="time"))
        yield from _Page(state).parts()

    return _written(filename, title, parts)


def _written(filename, title, parts):
    """Write what a function returns, after the checks of file and title."""
    path, title = require_path("filename", filename, (".html", ".htm")), require_text(
        "title", title)
    name = html.escape(path.stem if title is None else title)
    page = (f"<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><title>{name}</title>"
            f"<meta name='viewport' content='width=device-width, initial-scale=1'>"
            f"<style>{STYLE}</style></head>\n<body><h1>{name}</h1>\n" + "\n".join(
                part for part in parts() if part) + "\n</body></html>\n")
    with output_file(path) as temporary:
        Path(temporary).write_text(page, encoding="utf-8")
    return path


def _text(text, kind=""):
    return f"<p class='{kind}'>{html.escape(text)}</p>"


def _figure(draw, kind=""):
    found = picture(draw, DPI)
    return f"<figure class='{kind}'>{found}</figure>" if found else ""


def _table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table; numbers are tuples of one text."""
    rows = list(rows)
    cells = ["".join(f"<td class='number'>{html.escape(c[0])}</td>" if isinstance(c, tuple) else
                     f"<td>{html.escape(str(c))}</td>" for c in row) for row in rows[:ROWS]]
    more = _text(f"and {len(rows) - ROWS} more", "note") if len(rows) > ROWS else ""
    return "" if not rows else (
        "<table><tr>" + "".join(f"<th>{html.escape(h)}</th>" for h in head) + "</tr>"
        + "".join(f"<tr>{row}</tr>" for row in cells) + f"</table>{more}")


def total_force(system: Any, u: Array, force: Array) -> Array:
    """Resultant of a force on the DOFs (N,) and its moment about the origin, (3,)."""
    out = np.zeros(3)
    for member, s in zip(system.members, system.slices):
        f, q = force[s], (member.q0 + u[s]).reshape(-1, 2)
        out[:2] += member.rigid_motions()[:, :2].T @ f
        f = f.reshape(-1, 2)
        out[2] += np.sum(q[:, 0] * f[:, 1] - q[:, 1] * f[:, 0])
    return out


def supports_of(state: Any) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """Places of supports, and their reactions along x, along y, and moment."""
    system, known = state.system, set[str]()
    if (frame := system.constraints.frame) is not None:
        for node in np.flatnonzero(np.any(frame.fixed, axis=1)).tolist():
            found = state.reactions(node)
            yield f"node {node} at {_pair(frame.graph.points[:, node])}", (
                *found.force, found.moment)
    layout = Layout(*system.members)
    for item in system.items:
        symbols = [s for one in item.expand(layout) for s in one.symbols(layout)
                   if s.kind == "support"]
        if not symbols or not hasattr(item, "boundary"):
            continue
        try:
            found = state.reactions(item.boundary, item.beam)
        except AncfError:
            continue
        member = layout.beam(item.beam)
        place = (f"{_pair(symbols[0].at[0].start)} of {'beam ' * isinstance(member, Beam)}"
                 f"{name_of(system, member)}")
        if place not in known:
            known.add(place)
            yield place, (*found.force, found.moment)


def name_of(system: Any, member: Any) -> str:
    """Name or number of a member."""
    return str(system.members.index(member)) if member.name is None else member.name


class _Page:
    """The parts of the page of a state."""

    def __init__(self, state: Any) -> None:
        self.state, self.system = state, state.system
        self.units = units_of(state)
        self.strong = has_strength(state)

    def number(self, value: float, kind: str = "") -> tuple[str]:
        """A number with the unit of a length, force, moment or stress, as a cell."""
        return (rounded(value + 0.0, unit_in(self.units, kind)),)

    def parts(self) -> list[str]:
        """All sections of the page."""
        from importlib.metadata import version

        state = self.state
        how = ("linear, for small displacements" if state.base is not None else
               f"instant t = {state.t:g}{' of a motion' * bool(np.any(state._inertia))}"
               if state.t is not None else
               f"equilibrium for large displacements: {state.verdict}")
        units = "" if self.units is None else f" Units: {', '.join(self.units)}."
        start = state.replace(u=np.zeros_like(state.u), load=0.0, t=None)
        model = _figure(lambda: plot_scene(start, names=len(self.system.members) > 1))
        findings = state.checks.findings
        return [
            _text(f"{how[0].upper()}{how[1:]}. Load factor {state.load:g}.{units}"),
            "<h2>Model</h2>", model, self._model(),
            "<h2>Loads and supports</h2>", self._actions(),
            "<h2>Reactions</h2>", self._reactions(),
            "<h2>Results</h2>", self._extremes(), *(
                _figure(partial(state.plot, field, scale="auto")) for field in (
                    "displacement", "utilisation" if self.strong else "von_mises")),
            _table(("utilisation", "at", "of"), [
                ((f"{one.value:.3f}",), _pair(one.point), str(one.beam))
                for one in state.extremes()]) if self.strong else "",
            "<h2>Section forces</h2>" if state.beams else "", self._section_forces(),
            "<h2>Findings</h2>", *([_text(text, "bad") for text in findings]
                                   or [_text("None: the solution is within the range of its mesh "
                                             "and materials.")]),
            *(_text(f"Stress of beam {name} is that of its elements: {why}.", "note")
              for name, why in state.recovered.items() if why),
            _text(f"skfem-ancf {version('skfem-ancf')}, scikit-fem {version('scikit-fem')}, NumPy "
                  f"{np.__version__}, SciPy {version('scipy')}, Python "
                  f"{platform.python_version()}. {self.system.N} degrees of freedom. "
                  f"{date.today().isoformat()}", "note")]

    def _model(self):
        """Tables of beams, of bodies and domains, and of materials."""
        def cell(value, kind):
            return "–" if value is None else "f(x, y)" if callable(value) else (
                self.number(value, kind))

        def strength(given):
            return "–" if given is None else (" / ".join(
                self.number(x, "force / area")[0] for x in np.atleast_1d(given)),)

        beams, members = self.state.beams, self.system.members
        every = dict.fromkeys(one for member in members for one in materials_of(member))
        return _table(("beam", "length", "height", "section", "elements", "mass"), [
            (name_of(self.system, beam), self.number(float(np.sum(beam.mesh.lengths)), "length"),
             self.number(beam.mesh.height, "length"), str(beam.section).strip("<>"),
             f"{beam.mesh.nelements} × {type(beam.element).__name__}",
             (f"{beam.total_mass:.4g}",) if all(
                 layer.density is not None for layer in beam.across.layers) else "–")
            for beam in beams]
        ) + _table(("body", ""), [
            (name_of(self.system, one), repr(one).strip("<>")) for one in members[len(beams):]]
        ) + "\n" + _table(("material", "E", "ν", "density", "strength"), [
            (f"{getattr(m, 'title', '') or type(m).__name__}, plane {m.plane}",
             cell(grade or m.E, "force / area"), (f"{m.nu:g}",), cell(density, ""),
             strength(m.strength)) for m, grade, density in every])

    def _actions(self):
        rows = []
        for s in symbols_of(self.state, True, True, True):
            x, (a, b) = s.at[len(s.at) // 2].start, s.direction[0]
            place = "" if s.kind in ("weight", "drag") else f"({x[0]:.4g}, {x[1]:.4g})"
            if s.kind in ("support", "joint"):
                rows.append((s.kind, place, s.text.replace(" ", ", ") or "fixed", ""))
                continue
            direction = f"direction ({a:.3g}, {b:.3g})" if s.kind in ("force", "weight") else ""
            if len(s.at) > 1:
                place = f"from {_pair(s.at[0].start)} to {_pair(s.at[-1].start)}"
            value = (rounded(s.value + 0.0, unit_of_load(s, self.units)),) if s.kind in (
                "force", "moment", "weight", "mass") else ""
            rows.append(("distributed force" if s.per else s.kind, place,
                         f"{s.text.removesuffix('= ')} {direction}".strip(), value))
        for one in self.system.forces.contacts.obstacles:
            rows.append(("obstacle", "", repr(one.shape).strip("<>") + ", moves" * one.moves,
                         (f"friction {one.friction:g}",) if one.friction else ""))
        rows.sort(key=lambda row: row[0] in ("support", "joint"))
        return _table(("what", "where", "", "value"), dict.fromkeys(rows))

    def _reactions(self):
        """Forces of supports, and the balance of all forces."""
        state, system, u = self.state, self.system, self.state._acted
        reactions = list(supports_of(state))
        kinds = "force", "force", "moment"
        rows = [(place, *map(self.number, force, kinds)) for place, force in reactions]
        support = state._support_force()
        inertia, internal = state._inertia + np.zeros_like(u), state.internal_force
        joints = np.zeros_like(u) if not system.constraints.joints else (
            state.multipliers @ system.constraints.full_jacobian(u, state._time))
        parts = {"loads": internal + inertia + joints - support,
                 "supports": np.where(system.constraints.free, 0.0, support) - joints,
                 "springs, obstacles, foundations": -internal, "inertia and damping": -inertia}
        totals = {name: total_force(system, u, force) for name, force in parts.items()}
        every = [*totals.values(), *(force for _, force in reactions)]
        largest = max(np.max(np.abs(one[:2])) for one in every)
        size = largest or 1.0
        length = float(np.max(np.ptp(np.hstack([b.mesh.p for b in state.beams]), axis=1))
                       ) if state.beams else 1.0
        shown = [(name, *map(self.number, one, kinds)) for name, one in totals.items()
                 if name in ("loads", "supports") or np.max(
                     np.abs(one / [1, 1, length])) > 1e-9 * size]
        rest = sum(totals.values())
        error = max(np.max(np.abs(rest[:2])), abs(rest[2]) / length) / size
        least = NO_FORCE * min((float(np.min(b.across.bending)) for b in state.beams),
                               default=0.0) / length**2
        balance = _text("No forces act on the structure.", "note") if largest <= least else _text(
            f"The sum of all forces on the structure is {error:.1g} of the largest of them." + (
                " They are in balance." if error < BALANCED else "" if state.t is None else
                " The schemes of motions balance forces on average over a step."),
            "note" if error < BALANCED or state.t is not None else "bad")
        head = "along x", "along y", "moment"
        return _table(("support", *head), rows) + _table(
            ("all forces, moments about the origin", *head), shown) + balance

    def _extremes(self):
        rows = []
        for field, kind in LISTED.items():
            # of all beams, and of each domain
            for group in (self.state.beams, *([domain] for domain in self.system.domains)):
                every = []
                for b in group:
                    with suppress(AncfError):  # a law without this stress, or without strength
                        every += self.state.extremes(field, 1, beam=b)
                if every:
                    one = max(every, key=lambda e: abs(e.value))
                    rows.append((f"largest {field.replace('_', ' ')}", self.number(one.value, kind),
                                 _pair(one.point), str(one.beam)))
        return _table(("", "value", "at", "of"), rows)

    def _section_forces(self):
        if not self.state.beams:
            return ""
        lines, rows = lines_of(self.state, self.state.beams), []
        x = np.hstack([line["x"] for line in lines])
        beams = [line["beam"] for line in lines for _ in line["N"]]
        found = {name: np.concatenate([line[name] for line in lines]) for name in KINDS}
        force = np.max(np.abs([found["N"], found["Q"]]))
        for name, values in found.items():
            size = np.max(np.abs(values)) if name == "M" else force
            for what, k in (("maximum", np.argmax(values)), ("minimum", np.argmin(values))):
                value = float(values[k]) * bool(abs(values[k]) > ZERO * size)
                rows.append((f"{what} {name}", self.number(value, KINDS[name]), _pair(x[:, k]),
                             name_of(self.system, beams[k])))
        width, height = np.ptp(x, axis=1) + 2.0 * ROOM * np.max(np.ptp(x, axis=1))
        beside = height > width
        size = (7.0, 4.5) if beside else (6.3, min(9.5, 3.0 * (6.3 * height / width + 0.55)))
        axes = new_axes(size, *((1, 3) if beside else (3, 1)))
        integrated = (
            _text(f"Section forces of beam {name} are integrals of the stress of its elements, "
                  f"with its errors: {why}." + (
                      " The exact ones are zero." if why.endswith("no load") else ""), "note")
            for k, (name, why) in enumerate(self.state.recovered.items())
            if why and self.state._recovery_of(k, fields=False) is None)
        return "\n".join([
            _figure(lambda: self.state.plot_resultants(axes=axes, on="structure")[0], "tall")
            + _table(("", "value", "at", "beam"), rows), *integrated])


def _pair(x):
    x, y = np.round(x, ROUNDED) + 0.0
    return f"({x:.4g}, {y:.4g})"


#: Points of all beams together, along an element at least and at most, and across it.
POINTS, FEW, MANY, ACROSS = 4000, 4, 32, 8
#: Distance of places in heights of the section, and in sizes of a domain.
APART, IN_DOMAIN = 2.0, 0.1


class Extreme(NamedTuple):
    """A place of a large value of a field.

    Attributes
    ----------
    value
        The value; of a vector its magnitude.
    point
        The material point, in the reference configuration, shape (2,).
    beam
        Name of the beam or domain, or its number.
    kind
        "beam" or "domain".
    """

    value: float
    point: Array
    beam: Any
    kind: str = "beam"

    def __str__(self) -> str:
        x, y = self.point
        return f"{self.value:.4g} at ({x:.4g}, {y:.4g}) of {self.kind} {self.beam!r}"


class Output:
    """Extremes, files and pictures of a State."""

    def extremes(self, field: Any = "utilisation", count: int = 10, beam: WhichMember = None,
                 recover: bool = True) -> list[Extreme]:
        """The places where a field is largest in magnitude, two heights or more from each other.

        Components of a domain are in global axes; places in it are a tenth of its size apart.
        Raises InputError if the field has no value, as the utilisation without a strength.

        Parameters
        ----------
        field
            A scalar field or "displacement", as for :meth:`State.plot <skfem_ancf.State.plot>`;
            "utilisation" is the stress over the ``strength`` of the material.
        count
            Largest number of places.
        beam
            Beam or domain, its name or number; by default all that have the field.
        recover
            Recovered strain and stress if available.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> steel = StVenantKirchhoff(E=2.1e11, nu=0.3, strength=235e6)
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.1), ElementBeamANCF(2),
        ...             steel, width=0.06)
        >>> state = Scene(beam).clamp("left").point_force((0, -1e4), at=(1, 0)).solve_static()
        >>> worst = state.extremes()[0]  # 6 P L / (b h^2) / 235e6
        >>> round(worst.value, 2), worst.point.round(3).tolist(), worst.beam
        (0.43, [0.0, 0.05], 0)
        """
        state: Any = self
        recover, count = require_flag("recover", recover), require_integer("count", count, 1)
        wanted = find_field(field, DRAWN)
        members = state.system.members
        beams = [state._member(beam)] if beam is not None else [
            one for one in members if isinstance(one, (Beam, Domain))]
        total = sum(b.mesh.nelements for b in beams if isinstance(b, Beam))
        m = int(np.clip(POINTS // max(1, total), FEW, MANY))
        found: list[tuple[Extreme, float]] = []
        undefined: AncfError = no_value(wanted)
        for b in beams:
            if isinstance(b, Beam):
                kind, apart = "beam", APART * b.mesh.height
                v: Any = values_on_grid(state, b, layout(b, m, ACROSS)[0], recover)
            elif isinstance(b, Domain):
                kind, v = "domain", values_of_domain(state, b)[0]
                apart = IN_DOMAIN * float(np.max(np.ptp(v.x, axis=1)))
            else:
                raise InputError(f"extremes are those of beams and domains, got {b!r}, in which no "
                                 "field varies")
            try:
                values = wanted.of(v)
            except AncfError as error:
                if kind == "beam" and isinstance(error, CallbackError):
                    raise
                undefined = error  # of a law without this stress
                continue
            values = np.hypot(*values) if wanted.components == 2 else values
            size = np.abs(values - wanted.neutral)
            size[~np.isfinite(size)] = -1.0
            name = members.index(b) if b.name is None else b.name
            for _ in range(count):
                k = int(np.argmax(size))
                if size[k] < 0.0:
                    break
                found.append((Extreme(float(values[k]), v.x[:, k].copy(), name, kind),
                              float(size[k])))
                size[np.hypot(*(v.x - v.x[:, [k]])) < apart] = -1.0
        if not found:
            raise undefined
        return [one for one, _ in sorted(found, key=lambda pair: -pair[1])[:count]]

    def _repr_html_(self):
        return words(str(self)) + picture(self.plot)

    save = save_vtu
    to_xarray = to_xarray
    to_pyvista = pyvista.to_pyvista
    view = pyvista.view
    plot = matplotlib.plot_state
    plot_resultants = diagrams.plot_resultants
    report = report

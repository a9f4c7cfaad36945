"""The six examples: each function computes one and returns its tables and facts."""

import csv
from dataclasses import dataclass, field, replace

import numpy as np

import exact

from .continuum import cantilever_tip
from .models import BY_NAME, CASES, MODELS, TABLE4, TABLE4_ELEMENTS, THICK, Model

CONVERGENCE = ("model", "elements", "dofs", "value", "paper")
MOTION = ("t", "model", "tip_x", "tip_y", "strain_energy", "kinetic_energy", "potential_energy",
          "total_energy")
SHAPE = ("model", "X", "x", "y")

BODY_2D = "2D continuum"
LIKE_2D = "N=4 like 2D"


@dataclass
class Sheet:
    """A table of the paper, or what a figure of it is drawn from."""

    columns: tuple
    rows: list

    def of(self, model, *columns):
        """Columns of one model's rows, as arrays."""
        k = self.columns.index("model")
        rows = [row for row in self.rows if row[k] == model]
        return [np.array([row[self.columns.index(c)] for row in rows]) for c in columns]

    @property
    def models(self):
        """Names of the models, in order."""
        return list(dict.fromkeys(row[self.columns.index("model")] for row in self.rows))

    def write(self, filename):
        """Write a CSV file; what is not known stays empty."""
        with open(filename, "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(self.columns)
            writer.writerows([["" if v is None else f"{v:.10g}" if isinstance(v, float) else v
                               for v in row] for row in self.rows])


@dataclass
class Result:
    """What an example gives: sheets by the name of their file, and numbers for the report."""

    sheets: dict
    facts: dict = field(default_factory=dict)


# statics


def solve_all(case, counts, label, watch):
    """Equilibria of all models on all meshes with the paper's root conditions."""
    return {model.name: {n: case.cantilever(model, n).solve_static(tol=1e-10) for n in counts}
            for model in watch(MODELS, label)}


def convergence(states, point, component, paper):
    """Rows of a convergence table: a tip displacement against the number of elements."""
    return Sheet(CONVERGENCE, [
        (name, n, state.beams[0].N, float(state.displacement(point)[component]), paper(name, n))
        for name, by_count in states.items() for n, state in by_count.items()])


def axis_shape(state, parts=4):
    """Material coordinate and position of points of the axis: X, x, y."""
    beam = state.beams[0]
    xi = np.linspace(0.0, 1.0, parts + 1)
    points = np.array([xi, np.full_like(xi, 0.5)])
    start = beam.mesh.mapping().F(points)
    now = start + beam.displacements(state.u_of(beam), points)
    X, x, y = (np.append(a[:, :-1].ravel(), a[-1, -1]) for a in (start[0], now[0], now[1]))
    return [tuple(map(float, row)) for row in zip(X, x, y)]


def example_5_1(settings, watch):
    """Slender cantilever, small displacement: Fig. 6 and 7."""
    case = CASES["5.1"]
    states = solve_all(case, settings.elements_small, "5.1", watch)
    finest = max(settings.elements_small)
    top, bottom = exact.root_transverse_strain(-case.force[1], case.E, case.nu, case.L, case.h,
                                               case.b)
    section = []
    for name, by_count in states.items():
        for Y in np.linspace(-case.h / 2, case.h / 2, 21):
            theory = bottom + (top - bottom) * (Y / case.h + 0.5)
            strain = by_count[finest].strain((0.0, Y), recover=False)
            section.append((name, float(Y), float(strain[1]), float(theory)))
    EA, EI = case.E * case.b * case.h, case.E * exact.inertia(case.b, case.h)
    limit = exact.elastica_extensible_tip(-case.force[1], EA, EI, case.L)[1]
    return Result({"fig06": convergence(states, case.tip, 1, lambda name, n: None),
                   "fig07": Sheet(("model", "Y", "eps_yy", "theory"), section)},
                  {"limit": float(limit), "finest": finest})


def example_5_2(settings, watch):
    """Slender cantilever under its weight, large displacement: Tables 3 and 4, Fig. 9."""
    case = CASES["5.2"]
    states = solve_all(case, settings.elements_large, "5.2", watch)

    def paper(name, n):
        return dict(zip(TABLE4_ELEMENTS, TABLE4.get(name, ()))).get(n)

    shapes = [(name, *row) for name, by_count in states.items()
              for row in axis_shape(by_count.get(settings.elements)
                                    or by_count[max(settings.elements_large)])]
    potential = {name: [state.strain_energy + state.system.load_potential(state.u)
                        for state in states[name].values()] for name in ("N=2", "N=4")}
    return Result({"table3": convergence(states, case.tip, 0, lambda name, n: None),
                   "table4": convergence(states, case.tip, 1, paper),
                   "fig09": Sheet(SHAPE, shapes)},
                  {"limit": exact.gravity_cantilever(case.E, case.nu, case.rho, case.L, case.b,
                                                     case.h),
                   "gain": np.subtract(potential["N=4"], potential["N=2"])})


def example_5_3(settings, watch):
    """Thick cantilever, large displacement, and the same body in 2D: Fig. 11."""
    case = CASES["5.3"]
    states = solve_all(case, settings.elements_thick, "5.3", watch)
    finest = max(settings.elements_thick)
    sheet = convergence(states, case.tip, 1,
                        lambda name, n: THICK.get(name) if n == finest else None)
    # the beam that the 2D body is: a welded face, no shear factor, the force spread over the end
    traction = tuple(f / (case.b * case.h) for f in case.force)
    for model in watch([BY_NAME["N=4"]], "5.3 like 2D"):
        for n in settings.elements_thick:
            scene = case.scene(model, n, shear_correction=1.0, load=False)
            state = scene.clamp("left").traction("right", traction).solve_static()
            tip = float(state.displacement(case.tip)[1])
            sheet.rows.append((LIKE_2D, n, scene.layout.N, tip, None))
    for meshes in watch([settings.meshes_2d], "5.3 in 2D"):
        body = cantilever_tip(case, meshes)
    sheet.rows += [(BODY_2D, n, dofs, u_y, None) for n, dofs, _, u_y in body]
    return Result({"fig11": sheet}, {"limit": body[-1][3], "last": abs(body[-1][3] - body[-2][3])})


# dynamics


def move(case, model, settings, t_end, clamped, elements=None):
    """The motion from rest in the stress-free state under gravity."""
    n = settings.elements if elements is None else elements
    if model.formulation == "assumed":
        scene = case.scene(model, n, "auto")
        scene = scene.clamp("left") if clamped else scene.pin("left")
    else:
        scene = case.cantilever(model, n) if clamped else case.pendulum(model, n)
    every = settings.every * settings.dt
    return scene.integrate(t_end, settings.dt, settings.scheme, progress=False,
                           t_eval=every * np.arange(round(t_end / every) + 1))


def motions(number, settings, watch, t_end, shape_every, clamped=False):
    """All models' motions: the time file, the shapes, and the size of the time error."""
    case, rows, shapes, facts = CASES[number], [], [], {"drift": {}}
    for model in watch(MODELS, number):
        history = move(case, model, settings, t_end, clamped)
        tip = history.position(case.tip)
        columns = (history.t, tip[:, 0], tip[:, 1], history.strain_energy,
                   history.kinetic_energy, history.potential_energy, history.total_energy)
        rows += [(float(t), model.name, *map(float, rest)) for t, *rest in zip(*columns)]
        facts["drift"][model.name] = float(np.ptp(history.total_energy))
        for t in np.arange(0.0, t_end + 1e-9, shape_every):
            k = int(np.argmin(abs(history.t - t)))
            shapes += [(float(history.t[k]), model.name, *row)
                       for row in axis_shape(history.state(k))]
        if model.name == "N=3":
            coarse = tip
    halved = replace(settings, dt=settings.dt / 2, every=2 * settings.every)
    for model in watch([BY_NAME["N=3"]], f"{number} dt/2"):
        fine = move(case, model, halved, t_end, clamped).position(case.tip)
    facts["halving"] = float(np.max(np.linalg.norm(fine - coarse, axis=1)))
    return Sheet(MOTION, rows), Sheet(("t", *SHAPE), shapes), facts


def example_5_4(settings, watch):
    """Stiff pendulum: Fig. 13 to 15."""
    motion, shapes, facts = motions("5.4", settings, watch, 1.0, 0.25)
    case = CASES["5.4"]
    t = np.unique([row[0] for row in motion.rows])
    angle = exact.rigid_pendulum(t, case.L)
    facts["rigid"] = np.array([t, case.L * np.sin(angle), -case.L * np.cos(angle)])
    return Result({"fig13": shapes, "fig14": motion, "fig15": motion}, facts)


def example_5_5(settings, watch):
    """Soft pendulum: Fig. 17 to 20."""
    motion, shapes, facts = motions("5.5", settings, watch, 1.0, 0.25)
    for model in watch([Model("assumed", 3, None, "assumed", in_paper=False)], "5.5 limit"):
        history = move(CASES["5.5"], model, settings, 1.0, False, 4 * settings.elements)
        facts["limit"] = history.position(CASES["5.5"].tip)[-1]
    return Result({"fig17": shapes, "fig18": motion, "fig19": motion, "fig20": motion}, facts)


def example_5_6(settings, watch):
    """Cantilever released under gravity: Fig. 22 to 24."""
    motion, shapes, facts = motions("5.6", settings, watch, 0.3, 0.1, clamped=True)
    case = CASES["5.6"]
    facts["static"] = {model.name: case.cantilever(model, settings.elements).solve_static()
                       .position(case.tip) for model in watch(MODELS, "5.6 at rest")}
    return Result({"fig22": shapes, "fig23": motion, "fig24": motion}, facts)


@dataclass(frozen=True)
class Example:
    """An example: its function, and how many items its watch counts."""

    title: str
    compute: object
    runs: int


N = len(MODELS)
EXAMPLES = {
    "5.1": Example("Slender cantilever, small displacement", example_5_1, N),
    "5.2": Example("Slender cantilever under its weight, large displacement", example_5_2, N),
    "5.3": Example("Thick cantilever, large displacement", example_5_3, N + 2),
    "5.4": Example("Stiff pendulum", example_5_4, N + 1),
    "5.5": Example("Soft pendulum", example_5_5, N + 2),
    "5.6": Example("Cantilever released under gravity", example_5_6, 2 * N + 1),
}

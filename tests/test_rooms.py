"""Rooms: folders whose imports go one way, and functions of a size to be read at once."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import skfem_ancf

PACKAGE = Path(skfem_ancf.__file__).parent
#: Lines of a function without docstrings, and names of its arguments.
MOST_LINES, MOST_ARGUMENTS = 80, 10
#: Functions that are larger, and why.
LARGER = {
    "beam/beam.py::Beam.__init__": "options of a user, each with a default, by keyword",
    "dynamics/integrate.py::integrate": "options of a user, each with a default, by keyword",
    "results/state.py::State.__init__": "a record: what a solution is, and where it has it from",
    "solvers/continuation.py::continuation": "options of a user, each with a default, by keyword",
    "visuals/matplotlib.py::animate": "options of a user, each with a default, by keyword",
    "visuals/matplotlib.py::plot_state": "options of a user, each with a default, by keyword",
    "visuals/pyvista.py::view": "options of a user, each with a default, by keyword",
}

LARGER.update(dict.fromkeys((
    "actions/obstacles/obstacle.py::Obstacle.__init__",
    "materials/elastic_plastic.py::ElasticPlastic.__init__", "scene/frame.py::Frame.from_lines",
    "scene/frame.py::Frame.from_meshio", "scene/scene.py::Scene.continuation",
    "dynamics/history.py::History.plot", "scene/scene.py::Scene.integrate",
    "scene/scene.py::Scene.solve_static"),
    "options of a user, each with a default, by keyword"))

#: Lines of code of a file, and public names of a class.
MOST_CODE, MOST_NAMES = 500, 40
#: Files of kernels, and what has more names.
LARGER_FILES = {"beam/kernels/section.py"}
LARGER_CLASSES = {"Constraints", "System"}


def functions():
    """File, qualified name and syntax of every function of the package."""
    def walk(name, node):
        for child in ast.iter_child_nodes(node):
            inner = f"{name}.{child.name}" if hasattr(child, "name") else name
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)):
                yield inner.lstrip("."), child
            yield from walk(inner, child)

    for path in sorted(PACKAGE.rglob("*.py")):
        file = path.relative_to(PACKAGE).as_posix()
        for name, node in walk("", ast.parse(path.read_text(encoding="utf-8"))):
            yield f"{file}::{name}", node


def lines(function):
    """Lines from the first to the last, without docstrings."""
    docs = sum(node.body[0].end_lineno - node.body[0].lineno + 1 for node in ast.walk(function)
               if isinstance(node, ast.FunctionDef) and ast.get_docstring(node) is not None)
    return function.end_lineno - function.lineno + 1 - docs


def arguments(function):
    a = function.args
    names = [x.arg for x in (*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg) if x]
    return len(names) - (names[:1] in (["self"], ["cls"]))


def too_large(function):
    return lines(function) > MOST_LINES or arguments(function) > MOST_ARGUMENTS


def test_functions_are_of_a_size_to_be_read():
    found = {name: (lines(node), arguments(node)) for name, node in functions() if too_large(node)}
    assert {name: size for name, size in found.items() if name not in LARGER} == {}


def test_reasons_are_given_for_functions_that_are_larger():
    large = {name for name, node in functions() if too_large(node)}
    assert set(LARGER) <= large, "a reason is no longer needed"
    assert all(len(reason.split()) > 3 for reason in LARGER.values())


def code_lines(path):
    """Lines of a file that are neither empty, nor comments, nor docstrings."""
    text = path.read_text(encoding="utf-8")
    docs = {line for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
            for line in range(node.lineno, node.end_lineno + 1)}
    return sum(1 for k, line in enumerate(text.splitlines(), 1)
               if k not in docs and line.strip() and not line.strip().startswith("#"))


def public_names(cls):
    """What a class defines in its body, and attributes that its constructor sets; items that a
    scene has a method for are a list, each one line."""
    names = set()
    for node in cls.body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and (
                getattr(node.value.func, "id", "") == "adds"):
            continue
        targets = [node.target] if isinstance(node, ast.AnnAssign) else getattr(node, "targets", [])
        names |= {target.id for target in targets if isinstance(target, ast.Name)}
        if isinstance(node, ast.FunctionDef):
            names.add(node.name)
            if node.name == "__init__":
                names |= {x.attr for x in ast.walk(node) if isinstance(x, ast.Attribute)
                          and isinstance(x.ctx, ast.Store) and getattr(x.value, "id", "") == "self"}
    return {name for name in names if not name.startswith("_")}


def test_files_and_classes_are_of_a_size_to_be_read():
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        file = path.relative_to(PACKAGE).as_posix()
        if code_lines(path) > MOST_CODE and file not in LARGER_FILES:
            found[file] = code_lines(path)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if (isinstance(node, ast.ClassDef) and node.name not in LARGER_CLASSES
                    and len(public_names(node)) > MOST_NAMES):
                found[f"{file}::{node.name}"] = len(public_names(node))
    assert found == {}


# the order of the folders

#: From the ground up: a folder imports from those below its floor.
FLOORS = [["core"], ["mesh", "materials", "sweeps"], ["elements"],
          ["sections", "formulations"], ["beam"], ["actions", "recovery"],
          ["equations", "forms", "io", "visuals"], ["results"], ["solvers", "dynamics"], ["scene"],
          ["__main__"]]
FLOOR = {folder: height for height, folders in enumerate(FLOORS) for folder in folders}


def module_names():
    """Every module of the package by its name."""
    names = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def imports(name, path, names):
    """Modules that a module imports: at the top, inside functions and for annotations alike."""
    here = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = here[:len(here) - node.level + 1] if node.level else []
            base = ".".join([*base, *([node.module] if node.module else [])])
            found = [f"{base}.{alias.name}" if f"{base}.{alias.name}" in names else base
                     for alias in node.names]
        else:
            continue
        yield from (target for target in found if target in names and target not in (
            name, "skfem_ancf"))


def graph():
    names = module_names()
    return {name: set(imports(name, path, names)) for name, path in names.items()}


def folder_of(name):
    return name.split(".")[1]


def test_every_module_lies_in_a_room_of_the_plan():
    assert {folder_of(name) for name in module_names() if name != "skfem_ancf"} == set(FLOOR)


def test_imports_go_down():
    found = {(folder_of(a), folder_of(b)): f"{a} -> {b}"
             for a, targets in graph().items() if a != "skfem_ancf" for b in targets
             if folder_of(a) != folder_of(b) and FLOOR[folder_of(b)] >= FLOOR[folder_of(a)]}
    assert found == {}


def test_no_modules_import_each_other():
    TopologicalSorter(graph()).prepare()  # raises CycleError with the modules of a circle

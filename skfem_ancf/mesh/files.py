"""Files of beam meshes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skfem.generic_utils import OrientedBoundary

from ..core import archive
from ..core.errors import FileError, MeshError

#: Formats of several files that refer to each other: written in place.
IN_PARTS = (".xdmf", ".xmf", ".node", ".ele")
#: Optional attributes of a mesh.
OPTIONAL = ("s", "p_XY", "heights")
#: Required attributes of a mesh.
NEEDED = ("doflocs", "t", "height", "p_X", "p_Y", "lengths", "sections")


def save_npz(mesh: Any, path: Path) -> None:
    """Save a mesh without the functions ``curve`` and ``taper``."""
    content = {name: getattr(mesh, name) for name in (*NEEDED, *OPTIONAL, "kind")
               if getattr(mesh, name) is not None}
    for name, facets in (mesh.boundaries or {}).items():
        content[f"b_{name}"] = facets
        if getattr(facets, "ori", None) is not None:
            content[f"o_{name}"] = facets.ori
    content |= {f"s_{name}": elements for name, elements in (mesh.subdomains or {}).items()}
    try:
        archive.write(path, content)
    except OSError as error:
        raise FileError(f"cannot write {str(path)!r}: {error}") from error


def load_npz(cls: Any, path: Path, kinds: dict[str, Any]) -> Any:
    """Load a mesh saved by :func:`save_npz`, of class ``cls`` or of the kind in the file."""
    try:
        data = archive.read(path)
        missing = sorted(set(NEEDED) - data.keys())
        if missing:
            raise MeshError(f"{missing} are missing")
        kind = str(data.get("kind", cls.kind))
        if kind not in kinds:
            raise MeshError(f"its kind {kind!r} is not known, only {sorted(kinds)}")
        tags = {name[2:]: OrientedBoundary(facets, data[f"o_{name[2:]}"])
                if f"o_{name[2:]}" in data else facets
                for name, facets in data.items() if name.startswith("b_")}
        parts = {name[2:]: elements for name, elements in data.items() if name.startswith("s_")}
        return kinds[kind](
            data["doflocs"], data["t"], tags or None, parts or None,
            height=float(data["height"]), sections=str(data["sections"]),
            **{name: data[name] for name in ("p_X", "p_Y", "lengths", *OPTIONAL) if name in data})
    except OSError as error:
        raise FileError(f"cannot read {str(path)!r}: {error}") from error
    except MeshError as error:
        raise MeshError(f"{str(path)!r} contains no beam: {error}") from error
    except Exception as error:  # whatever is in the file
        raise MeshError(f"{str(path)!r} contains no beam, or is damaged: {type(error).__name__}: "
                        f"{error}") from error


def save_quads(mesh: Any, path: Path, *args: Any, **kwargs: Any) -> None:
    """Write the quads of a mesh in a format of meshio."""
    import meshio

    try:
        if not path.suffix:
            raise FileError(f"the file name {str(path)!r} has no suffix: end it with .npz, "
                            ".vtu or another format of meshio")
        if path.suffix in IN_PARTS:
            mesh.to_meshquad().save(path, *args, **kwargs)
            return
        with archive.replacing(path) as new:
            mesh.to_meshquad().save(new, *args, **kwargs)
    except FileError:
        raise
    except (OSError, meshio.ReadError, meshio.WriteError, SystemExit) as error:
        raise FileError(f"cannot write {str(path)!r}: {error}") from error

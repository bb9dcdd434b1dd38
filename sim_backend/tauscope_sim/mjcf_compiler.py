"""An MJCF compiled by MuJoCo, also where the meshes that it draws are not at hand."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

import warnings
from contextlib import suppress
from pathlib import Path

import mujoco

from tauscope.errors import RobotFileError


def compile_model(data: bytes, label: str, path: Path | None) -> mujoco.MjModel:
    """The compiled model; where files of shapes or textures are missing, without the shapes that carry no mass.

    Raises RobotFileError if MuJoCo refuses the file.
    `path`: where the file lies, for the files that it names; None for text without files beside it.
    """
    try:
        with warnings.catch_warnings(action="ignore"):  # attributes that MuJoCo will remove one day
            with suppress(ValueError):
                return _parse(data, path).compile()
            spec = _parse(data, path)
            _drop_shapes(spec)
            return spec.compile()
    except ValueError as error:
        reason = " ".join(str(error).split()).removeprefix("Error: ")
        remedy = "correct it"
        if "opening file" in reason:
            remedy = "put that file there" + ("" if "include" in reason else ", or state <inertial> of every body")
        raise RobotFileError(f"{label}: MuJoCo refuses the file ({reason}); {remedy}") from None


def _parse(data: bytes, path: Path | None) -> mujoco.MjSpec:
    """The editable model; of a file, so that what it names is found beside it."""
    return mujoco.MjSpec.from_string(data.decode()) if path is None else mujoco.MjSpec.from_file(str(path))


def _drop_shapes(spec: mujoco.MjSpec) -> None:
    """Delete meshes, height fields and textures, and the shapes that need them, where none of these gives a mass."""
    if spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return
    for body in spec.bodies:
        weighs = any(geom.meshname and geom.mass != 0.0 for geom in body.geoms)
        if weighs and not body.explicitinertial and _moves(body):
            return
    for geom in list(spec.geoms):
        if geom.meshname or geom.hfieldname:
            spec.delete(geom)
    for geom in spec.geoms:
        geom.material = ""
    for site in spec.sites:
        site.material = ""
    for kind in (spec.skins, spec.meshes, spec.hfields, spec.materials, spec.textures):
        for element in list(kind):
            spec.delete(element)


def _moves(body: mujoco.MjsBody) -> bool:
    while body is not None:
        if body.joints:
            return True
        body = body.parent
    return False

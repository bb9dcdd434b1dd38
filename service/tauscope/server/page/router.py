"""The page and its files, and its example: a simulated arm of two joints, recorded twice, with a concealed spring."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import distribution
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from fastapi import APIRouter, Request, Response

from tauscope.dynamics import friction_torque, inverse_dynamics
from tauscope.errors import NotFoundError
from tauscope.robot import Robot, read_robot
from tauscope.robot.messages import shown
from tauscope.robot.robot import Array
from tauscope.runtime.drivers import driver_names, find_driver

ROBOT = """\
name: example-arm
kinematics:
  dh:
    - {theta: 0.0, d: 0.2, a: 0.4, alpha: 0.0, type: revolute}
    - {theta: 0.0, d: 0.0, a: 0.3, alpha: 0.0, type: revolute}
gravity: [0, -9.81, 0]
joints:
  - name: shoulder
    limits: {position: [-2.9, 2.9], velocity: 3.0, acceleration: 12.0, torque: 40}
    friction_shape: {k_v: 500, delta: 10}
  - name: elbow
    limits: {position: [-2.9, 2.9], velocity: 3.0, acceleration: 12.0, torque: 20}
    friction_shape: {k_v: 500, delta: 10}
model:
  links:
    - {mass: 3.0, first_moment: [-0.6, 0, 0], inertia: {xx: 0.01, yy: 0.17, zz: 0.17, xy: 0, xz: 0, yz: 0}}
    - {mass: 1.5, first_moment: [-0.2, 0, 0], inertia: {xx: 0.005, yy: 0.05, zz: 0.05, xy: 0, xz: 0, yz: 0}}
  friction:
    - {stiction: 1.2, stribeck: -0.2, viscous: 0.6}
    - {stiction: 0.6, stribeck: -0.1, viscous: 0.3}
"""

SPRING_NM_PER_RAD = 2.5
"""Stiffness of the concealed spring at the elbow, at rest at 0 rad: about half of the elbow's torque."""
NOISE_STD_NM = 0.1
RATE_HZ = 100.0
PERIOD_S, PERIODS = 10.0, 2
HARMONICS = 5
MOTIONS = {"example-train.csv": (1, 1.5), "example-held-out.csv": (2, 1.1)}
"""Seed and reach [rad] of each recording: training moves wider than the motion that judges it."""


@cache
def example_files() -> dict[str, bytes]:
    with TemporaryDirectory(prefix="tauscope-example-") as folder:
        path = Path(folder) / "example-arm.yaml"
        path.write_text(ROBOT, encoding="utf-8")
        robot = read_robot(path)
    made = {name: _recording(robot, reach, np.random.default_rng(seed)) for name, (seed, reach) in MOTIONS.items()}
    return {"example-arm.yaml": ROBOT.encode(), **made}


def _recording(robot: Robot, reach: float, rng: np.random.Generator) -> bytes:
    """A random periodic motion as CSV: torques of the model and the spring, and noise."""
    time = np.arange(0.0, PERIODS * PERIOD_S, 1.0 / RATE_HZ)
    q, qd, qdd = _motion(time, len(robot.joints), reach, rng)
    links, friction = robot.model.links or (), robot.model.friction or ()
    torque = inverse_dynamics(robot, np.concatenate([link.to_vector() for link in links]), q, qd, qdd)
    for place, (joint, coefficients) in enumerate(zip(robot.joints, friction, strict=True)):
        torque[:, place] += friction_torque(coefficients, joint.friction_shape, qd[:, place])
    torque[:, 1] += SPRING_NM_PER_RAD * q[:, 1]
    torque += rng.normal(scale=NOISE_STD_NM, size=torque.shape)
    period = np.floor(time / PERIOD_S)
    rows = [
        f"{t:.2f},{','.join(f'{value:.6f}' for value in (*angles, *torques))},{count:.0f}"
        for t, angles, torques, count in zip(time, q, torque, period, strict=True)
    ]
    return "\n".join(["t,q1,q2,tau1,tau2,period", *rows, ""]).encode()


def _motion(time: Array, joints: int, reach: float, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration of Fourier sums, (N, n) each [rad, rad/s, rad/s²]."""
    omega = 2.0 * np.pi / PERIOD_S * np.arange(1, HARMONICS + 1)
    phase = np.outer(time, omega)
    a, b = rng.normal(size=(2, HARMONICS, joints)) / HARMONICS
    sine, cosine = np.sin(phase), np.cos(phase)
    scale = reach / np.abs(sine @ a + cosine @ b).max(axis=0)
    a, b = a * scale, b * scale
    q = sine @ a + cosine @ b
    qd = (cosine * omega) @ a - (sine * omega) @ b
    return q, qd, -(sine * omega**2) @ a - (cosine * omega**2) @ b


router = APIRouter(include_in_schema=False)
STATIC = Path(__file__).parent / "static"
MEDIA_TYPES: Mapping[str, str] = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
PLOT_LIBRARY: Mapping[str, str] = {"uplot.js": "uplot/static/uPlot.iife.js", "uplot.css": "uplot/static/uPlot.min.css"}
"""Files of the installed package uplot-python, by the names that the page knows them by."""
HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:;"
    " connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    "Cache-Control": "no-cache",
}


@dataclass(frozen=True)
class Asset:
    content: bytes
    media_type: str
    tag: str


@router.get("/")
def show_page(request: Request) -> Response:
    return _answer(request, "index.html")


@router.get("/page/{name}")
def show_asset(request: Request, name: str) -> Response:
    return _answer(request, name)


def _answer(request: Request, name: str) -> Response:
    asset = assets().get(name)
    if asset is None:
        raise NotFoundError(f"the page has no file {shown(name)}; open / instead")
    headers = {**HEADERS, "ETag": asset.tag}
    if request.headers.get("if-none-match") == asset.tag:
        return Response(status_code=304, headers=headers)
    return Response(asset.content, media_type=asset.media_type, headers=headers)


@router.get("/example/{name}")
def show_example(name: str) -> Response:
    content = example_files().get(name)
    if content is None:
        raise NotFoundError(f"the example has no file {shown(name)}; it has {', '.join(example_files())}")
    return Response(content, media_type="application/octet-stream", headers=HEADERS)


@cache
def assets() -> Mapping[str, Asset]:
    package = distribution("uplot-python")
    paths = {path.name: path for path in sorted(STATIC.iterdir()) if path.suffix in MEDIA_TYPES}
    paths |= {name: Path(str(package.locate_file(file))) for name, file in PLOT_LIBRARY.items()}
    contents = {name: path.read_bytes() for name, path in paths.items()}
    contents["drivers.js"] = _drivers_script()
    return {
        name: Asset(content, MEDIA_TYPES[Path(name).suffix], f'"{hashlib.sha256(content).hexdigest()[:24]}"')
        for name, content in contents.items()
    }


def _drivers_script() -> bytes:
    """The registered drivers as a module of the page: title, and whether each is a simulation."""
    drivers = [find_driver(name) for name in driver_names()]
    content = {one.name: {"title": one.title, "is_simulated": one.is_simulated} for one in drivers}
    return f"export const DRIVERS = {json.dumps(content, ensure_ascii=False)};\n".encode()

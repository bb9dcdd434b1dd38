"""The numbers behind the figures."""

from tauscope.identification import IdentificationDocument
from tauscope.number_text import ABSENT, percent, significant, with_uncertainty
from tauscope.report.provenance import Provenance
from tauscope.report.table import Table
from tauscope.report.words import base_parameter_unit, noise_ratio, torque_unit
from tauscope.robot import Robot

_COEFFICIENTS = ("stiction", "stribeck", "viscous", "offset", "k_v", "delta")


def fit_table(document: IdentificationDocument, robot: Robot) -> Table:
    """Noise and residual of every joint."""
    fit = document.fit
    unseen = fit.held_out.rms if fit.held_out else [None] * len(document.joints)
    rows = []
    for place, joint in enumerate(robot.joints):
        noise, own, other = document.noise_std[place], fit.train.rms[place], unseen[place]
        ratio = noise_ratio(own if other is None else other, noise)
        numbers = [significant(number, 3) for number in (noise, own, other, ratio)]
        rows.append([document.joints[place], *numbers, torque_unit(joint.type)])
    errors = (fit.train.relative_error, fit.held_out.relative_error if fit.held_out else None)
    rows.append(["relative error in the band", "", *(percent(error) for error in errors), "", ""])
    columns = ("joint", "noise σ", "residual rms", "held out", "residual / noise", "unit")
    return Table(columns, rows)


def friction_table(document: IdentificationDocument) -> Table:
    """Friction coefficients with standard errors; in brackets what the data cannot tell."""
    rows = []
    for entry in document.friction:
        cells = [entry.joint]
        for name in _COEFFICIENTS:
            value = getattr(entry, name)
            if value is None or (name == "stribeck" and entry.delta is None):
                cells.append(ABSENT)
                continue
            number, error = with_uncertainty(value, entry.std.get(name))
            words = number if error == ABSENT else f"{number} ± {error}"
            cells.append(words if entry.identifiable.get(name, True) else f"({words})")
        rows.append(cells)
    return Table(("joint", "stiction τ_s", "Stribeck τ_sc", "viscous τ_v", "offset", "K_v", "δ"), rows)


def rotor_table(document: IdentificationDocument) -> Table:
    """Reflected rotor inertia where the data ask for it."""
    rows = [[entry.joint, *with_uncertainty(entry.value, entry.std)] for entry in document.rotor_inertia]
    return Table(("joint", "I_a [kg m², kg]", "± std"), rows)


def base_parameter_table(document: IdentificationDocument) -> Table:
    """Base parameters with standard errors, and whose values they are."""
    rows = []
    for entry in document.base_parameters:
        pair = (ABSENT, ABSENT) if entry.std is None else with_uncertainty(entry.value, entry.std)
        rows.append([entry.name, *pair, base_parameter_unit(entry.terms), entry.determined_by or ABSENT])
    return Table(("parameter", "value", "± std", "unit", "determined by"), rows)


def link_table(document: IdentificationDocument) -> Table:
    """Mass, centre of mass and inertia of every link."""
    rows = []
    for number, link in enumerate(document.links, start=1):
        centre = [moment / link.mass if link.mass > 0.0 else None for moment in link.first_moment]
        inertia = (getattr(link.inertia, axes) for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
        rows.append([str(number), *(significant(value) for value in (link.mass, *centre, *inertia))])
    centres = [f"c{axis} [m]" for axis in "xyz"]
    return Table(("link", "m [kg]", *centres, "Ixx [kg m²]", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"), rows)


def conditioning_table(document: IdentificationDocument) -> Table:
    """What every recording holds, and what was done to it."""
    rows = []
    for used, entries in (("estimate", document.conditioning), ("held out", document.held_out_conditioning)):
        for entry in entries:
            masked = (entry.missed_positions, sum(entry.missed_torques), entry.dropped, entry.gaps)
            periods = str(entry.averaged_periods) if entry.averaged_periods else ABSENT
            rate = significant(entry.rate_hz, 4) + (" (resampled)" if entry.resampled else "")
            sources = ", ".join(sorted(set(entry.velocity_source)))
            rows.append([entry.recording, used, sources, str(entry.samples), rate, periods, *map(str, masked)])
    columns = ("recording", "use", "motion taken from", "samples", "rate [Hz]", "periods averaged")
    return Table((*columns, "no position", "no torque", "too short", "gaps"), rows, words=3)


def input_table(provenance: Provenance) -> Table:
    """Files with their hashes."""
    rows = [[entry.path, entry.role, entry.sha256, str(entry.size_bytes)] for entry in provenance.inputs]
    return Table(("file", "read as", "SHA-256", "bytes"), rows, words=3)

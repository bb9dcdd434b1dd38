"""Tables of words and numbers, wherever they are shown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tauscope.diagnosis import DiagnosisDocument
from tauscope.identification import IdentificationDocument
from tauscope.number_text import ABSENT, percent, significant, with_uncertainty
from tauscope.report.provenance import Provenance
from tauscope.report.words import base_parameter_unit, effect_title, noise_ratio
from tauscope.robot import Robot


def csv_text(columns: Mapping[str, Sequence[float]]) -> str:
    """A heading line, then a line a sample."""
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(f"{value:.5g}" for value in row) for row in rows)])


@dataclass(frozen=True)
class Table:
    """Cells as text."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: int = 1


MOST_SHIFTS = 12  # rows of the parameters that findings have moved most


def located_table(document: DiagnosisDocument) -> Table:
    """Where the mismatch is, joint by joint."""
    rows = []
    for entry in document.mismatch:
        variable, span, share, time = [ABSENT] * 4
        if entry.where is not None:
            variable, share = entry.where.variable.replace("_", " "), percent(entry.where.share)
            span = " … ".join(significant(value, 3) for value in entry.where.range)
        if entry.time is not None:
            time = " … ".join(significant(value, 3) for value in entry.time.range)
        is_clear = "yes" if entry.significant else "no"
        rows.append((entry.joint, is_clear, variable, significant(entry.excess_rms, 3), span, share, time))
    columns = ("joint", "more than noise", "concentrated in", "excess rms", "from … to", "share", "time [s]")
    return Table(columns, rows, words=3)


def detectable_table(document: DiagnosisDocument) -> Table:
    """The smallest size that these data would have shown: a row an effect, a column a joint."""
    places: list[str | None] = [*document.joints, None]
    found = {(entry.effect, entry.joint): entry for entry in document.detectable}
    places = [place for place in places if any(joint == place for _, joint in found)]
    rows = []
    for effect in dict.fromkeys(entry.effect for entry in document.detectable):
        own = [found.get((effect, place)) for place in places]
        units = list(dict.fromkeys(entry.unit for entry in own if entry is not None))
        sizes = ["" if entry is None else significant(entry.minimum, 2) for entry in own]
        rows.append((effect_title(effect), ", ".join(units), *sizes))
    return Table(("effect", "unit", *(place or "whole arm" for place in places)), rows, words=2)


def residual_table(document: DiagnosisDocument) -> Table:
    """Residuals before and after, on training and held-out recordings."""
    train, held_out = document.fit.train, document.fit.held_out
    columns = ["joint", "before", "after"]
    values = [train.rms_before, train.rms_after]
    if held_out is not None:
        columns += ["held out before", "held out after"]
        values += [held_out.rms_before, held_out.rms_after]
    rows = [(name, *(significant(row[place], 3) for row in values)) for place, name in enumerate(document.joints)]
    return Table(tuple(columns), rows, words=1)


def difference_table(document: DiagnosisDocument) -> Table:
    """What the simulation has wrong."""
    rows = [
        (e.parameter, *(significant(value, 4) for value in (e.simulation, e.real)), significant(e.difference_in_std, 3))
        for e in document.parameter_differences
    ]
    return Table(("parameter", "simulation", "arm", "standard errors"), rows, words=1)


def shift_table(document: DiagnosisDocument) -> Table:
    """What the left-out effects had done to the parameters."""
    rows = [
        (e.parameter, *(significant(value, 4) for value in (e.before, e.after)), significant(e.shift_in_std, 3))
        for e in document.parameter_shifts[:MOST_SHIFTS]
    ]
    return Table(("parameter", "before", "after", "standard errors"), rows, words=1)


def headroom_table(document: DiagnosisDocument) -> Table:
    """What a black box still predicts of held-out motion; no row where it was not asked for."""
    rows = [
        (
            entry.joint,
            *(significant(value, 3) for value in (entry.plain, entry.explained, entry.black_box, entry.floor)),
            entry.floor_kind.replace("_", " "),
            " ± ".join(f"{100.0 * value:.0f}" for value in (entry.share, entry.share_std) if value is not None),
            "yes" if entry.refuted else "no",
        )
        for entry in document.headroom or ()
    ]
    columns = ("joint", "plain", "explained", "black box", "floor", "floor from", "predicted [%]", "refuted")
    return Table(columns, rows, words=1)


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
        rows.append([document.joints[place], *numbers, joint.type.torque_unit])
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

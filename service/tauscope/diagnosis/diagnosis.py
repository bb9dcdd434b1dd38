"""From a robot and recordings to what its model leaves out: the whole way, in the order of the steps."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from threadpoolctl import ThreadpoolController

from tauscope.diagnosis.deflection.measured import measure_deflection
from tauscope.diagnosis.findings.conclude import conclude
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.direct import with_direct_findings
from tauscope.diagnosis.findings.finding import Finding, FitSizes
from tauscope.diagnosis.findings.plain import undeclared_offsets, with_plain_terms, with_rivals_of_constants
from tauscope.diagnosis.findings.wrong_sign import with_wrong_signs
from tauscope.diagnosis.search.from_recordings import search
from tauscope.identification import Options, identify
from tauscope.recording.recording import Recording
from tauscope.robot import Robot

__all__ = ["Diagnosis", "Finding", "FitSizes", "diagnose"]
DEFAULT = Options()  # an identification as nobody asked otherwise
Progress = Callable[[str], None]


@ThreadpoolController().wrap(limits=1, user_api="blas")  # many small factors: threads cost more than they bring
def diagnose(
    robot: Robot,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording] = (),
    options: Options = DEFAULT,
    progress: Progress = lambda step: None,
) -> Diagnosis:
    """What the best nominal model of an arm leaves out. Raises TauscopeError where recordings tell no parameters."""
    identification = identify(robot, recordings, held_out, options, progress)
    wrong = identification.reversed_joints
    if wrong:
        identification = identify(_reverse(robot, wrong), recordings, held_out, options, progress)
    searched = search(identification, recordings, held_out, progress)
    progress("weigh the evidence")
    found = conclude(identification, searched)
    model = searched.found.nominal.model
    again = measure_deflection(held_out, identification, model, searched.cutoff_hz)
    found = with_direct_findings(found, searched.deflections, again)
    found = with_rivals_of_constants(with_plain_terms(found, undeclared_offsets(found)), searched)
    return with_wrong_signs(found, wrong)


def _reverse(robot: Robot, joints: Sequence[int]) -> Robot:
    """The robot with the other sign of some joints' torque."""
    turned = [
        replace(joint, sign=-joint.sign) if place in joints else joint for place, joint in enumerate(robot.joints)
    ]
    return replace(robot, joints=tuple(turned))

"""All kinds of effects that are concealed in real recordings."""

from concealed.real.concealing import channels, joint_laws, robot_file, tip
from concealed.real.concealing.joint_laws import Draw

KINDS: dict[str, Draw] = {
    draw.__name__: draw
    for draw in (
        joint_laws.spring,
        joint_laws.cable,
        joint_laws.cogging,
        joint_laws.ripple,
        joint_laws.load_friction,
        joint_laws.asymmetric_coulomb,
        joint_laws.asymmetric_viscous,
        joint_laws.nonlinear_viscous,
        joint_laws.position_friction,
        joint_laws.bristles,
        joint_laws.drift,
        joint_laws.coupling,
        channels.gain_joint,
        channels.sign_joint,
        channels.sign_all,
        channels.delay_joint,
        channels.delay_all,
        channels.saturation,
        tip.payload_change,
        tip.contact,
        robot_file.gravity,
        robot_file.link_length,
    )
}

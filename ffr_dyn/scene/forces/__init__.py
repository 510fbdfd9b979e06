"""Forces, a file for each kind; importing this makes them all known. What a kind says of itself is in `force`.

The order is that of documentation and of the kinds in a scene file.
"""

from ffr_dyn.scene.forces.load import Load  # noqa: I001 - the order of the documentation
from ffr_dyn.scene.forces.spring_damper import SpringDamper
from ffr_dyn.scene.forces.bushing import Bushing
from ffr_dyn.scene.forces.joint_spring import JointSpring
from ffr_dyn.scene.forces.joint_friction import JointFriction
from ffr_dyn.scene.forces.joint_stop import JointStop
from ffr_dyn.scene.forces.actuator import Actuator
from ffr_dyn.scene.forces.servo import Servo
from ffr_dyn.scene.forces.nodal_forces import NodalForces
from ffr_dyn.scene.forces.pressure import Pressure
from ffr_dyn.scene.forces.modal_force import ModalForce

__all__ = [
    "Actuator", "Bushing", "JointFriction", "JointSpring", "JointStop", "Load", "ModalForce", "NodalForces", "Pressure",
    "Servo", "SpringDamper",
]  # fmt: skip

"""The declaration of a machine: bodies, joints, drivers, forces, sensors."""

"""What is declared of a machine: bodies, joints, drivers, forces, sensors."""

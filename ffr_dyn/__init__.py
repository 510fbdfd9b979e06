"""From reduced bodies to a moving machine: flexible multibody dynamics in the floating frame of reference."""

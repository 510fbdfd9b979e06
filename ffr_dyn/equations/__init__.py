"""The equations of motion in readable form, to which tests hold the compiled form."""

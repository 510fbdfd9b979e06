"""Many runs of one scene over parameters of it and of the making of its bodies."""

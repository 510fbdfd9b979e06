"""The two ways in which a call can fail. The command line turns them into exit codes 2 and 1."""


class InputError(ValueError):
    """What the user gave cannot be used. The message names the thing, its value and the remedy."""


class ComputationError(RuntimeError):
    """The input was acceptable but the computation failed. The message says where, how far off and what to try."""

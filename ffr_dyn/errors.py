"""The two ways in which a call can fail. The command line turns them into exit codes 2 and 1."""


class InputError(ValueError):
    """What the user gave cannot be used. The message names the thing, its value and the remedy."""


class SimulationError(RuntimeError):
    """The scene was acceptable but the analysis failed. The message says when, where, the likely cause and what to try."""

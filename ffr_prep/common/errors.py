"""The two ways in which a call can fail. The command line turns them into exit codes 2 and 1."""


class InputError(ValueError):
    """Input that cannot be used. The message names the thing, its value and the remedy.

    >>> try: rod = fd.load_body("rod.ffr")
    ... except fd.InputError as error: print(error)
    """


class ComputationError(RuntimeError):
    """The input was acceptable but the computation failed. The message says where, how far off and what to try.

    >>> try: result = fd.static(scene)
    ... except fd.ComputationError as error: print(error)
    """

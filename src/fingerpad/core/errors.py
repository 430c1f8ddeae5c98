"""The failures everybody shares: one sentence that says what was expected, what came and what to do."""


class FingerpadError(Exception):
    """Base of every error that fingerpad raises on purpose."""


class InputError(FingerpadError, ValueError):
    """An argument, option or file that cannot be used as given."""


class StoreError(FingerpadError):
    """A stored result that cannot be read or written."""


class ConvergenceError(FingerpadError, RuntimeError):
    """A solve that did not converge; nothing of it is kept.

    Parameters
    ----------
    message : str
        What failed, where, and what to try.
    history : tuple of str, optional
        One line per attempt, oldest first.
    """

    def __init__(self, message: str, history: tuple[str, ...] = ()):
        super().__init__(message)
        self.history = history

    def __str__(self) -> str:
        return "\n  ".join((super().__str__(), *self.history))


class MaterialWarning(UserWarning):
    """A material that can be used, but loses its stability within the range of stretches of a touch."""

"""The exceptions of the package."""


class Error(Exception):
    """A failure of a run or a study; the base of all exceptions of this package."""


class SceneError(Error, ValueError):
    """A scene that is refused.

    Attributes:
        message: what is refused, and what is accepted; all errors of the scene, a line each.
        file: the file of the scene, or its name.
        line: line of the first error, from 1; None for an override, or for the scene as a whole.
        column: column of the first error, from 1; None where line is None.
    """

    def __init__(self, message, file=None, line=None, column=None):
        super().__init__(message)
        self.message = message
        self.file = file
        self.line = line
        self.column = column


class ArgumentError(Error, ValueError):
    """An argument that is not accepted: its type, its length, its range or its name. The message says what is."""


class HandleError(Error):
    """A plant, a loop or a block that was closed, or that another thread is using."""


class EndError(Error):
    """The scene has ended, or its device cannot go on. The plant stands at the edge at which that happened."""

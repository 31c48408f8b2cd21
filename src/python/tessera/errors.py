"""What goes wrong, as exceptions: who has to do something about it is the class."""


class Error(Exception):
    """Base of all that Tessera raises.

    kind: "usage", "data", "system" or "cancelled".
    subject: the operation, parameter, argument or file that it is about.
    reason: what was found, and what was expected.
    hint: what may help: the nearest name, or what was expected; "" for none.
    """

    kind = "usage"

    def __init__(self, subject, reason=""):
        super().__init__(subject, reason)
        self.subject, self.reason = subject, reason

    def __str__(self):
        return f"{self.subject}: {self.reason}" if self.reason else self.subject

    @property
    def hint(self):
        for mark in ("; did you mean ", ", expected "):
            if mark in self.reason:
                return self.reason[self.reason.rindex(mark) + 2:]
        return ""


class UsageError(Error, ValueError):
    """What was asked for is wrong, whatever the images are: a name, a value out of its range."""


class DataError(Error):
    """It does not suit these images, or a file is missing or does not hold what it should."""

    kind = "data"


class SystemError_(Error):
    """The system refused memory or a file. The underscore leaves Python's own SystemError alone."""

    kind = "system"


class Cancelled(Error):
    """A progress function returned False."""

    kind = "cancelled"


_CLASSES = {cls.kind: cls for cls in (UsageError, DataError, SystemError_, Cancelled)}


def error_of(kind, subject, reason):
    """The exception for an error of the library."""
    return _CLASSES[kind](subject, reason)

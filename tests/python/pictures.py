"""What the tests share: pictures that are exact in every language, hashes, refusals."""
import contextlib

import numpy as np
import tessera as ts

WIDTH, HEIGHT, CHANNELS = 24, 16, 4


def picture(k, width=WIDTH, height=HEIGHT, channels=CHANNELS):
    """That of tests/c/rows.cc."""
    y, x, c = np.mgrid[0:height, 0:width, 0:channels]
    return (((7 * x + 13 * y + 5 * c + 11 * k + x * y) % 32) / 32).astype(np.float32)


def fnv(data):
    value = 14695981039346656037
    for byte in data:
        value = (value ^ byte) * 1099511628211 & 0xffffffffffffffff
    return value


@contextlib.contextmanager
def refused(kind, *words):
    """What is inside raises an error of that class that says all these words."""
    try:
        yield
    except kind as error:
        for word in words:
            assert word in str(error), f"{error} says nothing of {word}"
        if issubclass(kind, ts.Error):
            assert error.subject and error.reason
        return
    raise AssertionError(f"was accepted, expected {kind.__name__}")


def address(array):
    return array.__array_interface__["data"][0]

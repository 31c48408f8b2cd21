#!/usr/bin/env python3
"""The C interface from Python's ctypes, nothing else: every operation, errors, callbacks, files.

usage: foreign_test.py LIBRARY ROWS FOLDER
"""
import ctypes as c
import os
import sys
import threading

LIBRARY, ROWS, FOLDER = sys.argv[1:]
tessera = c.CDLL(LIBRARY)
WIDTH, HEIGHT, CHANNELS = 24, 16, 4
OK, USAGE, DATA, SYSTEM, CANCELLED = range(5)
FLOAT = 4
PROGRESS = c.CFUNCTYPE(c.c_int32, c.c_double, c.c_void_p)


class Sized(c.Structure):
    """A structure whose first member is its size."""

    def __init__(self, **members):
        super().__init__(struct_size=c.sizeof(self), **members)


class Window(c.Structure):
    _fields_ = [(name, c.c_int32) for name in ("x0", "y0", "x1", "y1")]


class Pixels(Sized):
    _fields_ = [("struct_size", c.c_size_t), ("data", c.c_void_p), ("window", Window), ("channels", c.c_int32),
                ("type", c.c_int32), ("channel_stride", c.c_int64), ("pixel_stride", c.c_int64),
                ("row_stride", c.c_int64)]


class ImageInfo(Sized):
    _fields_ = [("struct_size", c.c_size_t), ("data_window", Window), ("display_window", Window),
                ("channels", c.c_int32), ("alpha", c.c_int32), ("type", c.c_int32)]


class OperationInfo(Sized):
    _fields_ = [("struct_size", c.c_size_t)] + [(name, c.c_char_p) for name in (
        "name", "family", "summary", "help", "bound")] + [
        ("bound_u", c.c_double), ("generator", c.c_int32), ("images", c.c_int32), ("parameters", c.c_size_t),
        ("examples", c.c_size_t)]


class ParameterInfo(Sized):
    _fields_ = [("struct_size", c.c_size_t), ("name", c.c_char_p), ("kind", c.c_int32), ("positional", c.c_int32),
                ("required", c.c_int32), ("default_value", c.c_char_p), ("help", c.c_char_p), ("use", c.c_char_p),
                ("minimum", c.c_double), ("maximum", c.c_double), ("count_minimum", c.c_int32),
                ("count_maximum", c.c_int32), ("counts", c.c_size_t), ("choices", c.c_size_t),
                ("numbers_too", c.c_int32)]


class RenderOptions(Sized):
    _fields_ = [("struct_size", c.c_size_t), ("threads", c.c_int32), ("memory", c.c_uint64), ("progress", PROGRESS),
                ("user", c.c_void_p), ("context", c.c_void_p)]


class ContextUse(Sized):
    _fields_ = [("struct_size", c.c_size_t)] + [(name, c.c_uint64) for name in ("memory", "cache", "entries")]


for function in ("tessera_version", "tessera_error_subject", "tessera_error_reason", "tessera_operation_example",
                 "tessera_parameter_choice", "tessera_image_channel"):
    getattr(tessera, function).restype = c.c_char_p
for function in ("tessera_operation_at", "tessera_operation_find"):
    getattr(tessera, function).restype = c.c_void_p
tessera.tessera_operation_count.restype = c.c_size_t
tessera.tessera_operation_at.argtypes = [c.c_size_t]


class Failure(Exception):
    """A tessera_error."""

    def __init__(self, status, subject, reason):
        super().__init__(f"{subject}: {reason}")
        self.status, self.subject = status, subject


def call(function, *arguments):
    """Calls a function whose last argument is where an error goes."""
    error = c.c_void_p()
    status = getattr(tessera, function)(*arguments, c.byref(error))
    if status == OK:
        assert not error
        return
    failure = Failure(status, tessera.tessera_error_subject(error).decode(),
                      tessera.tessera_error_reason(error).decode())
    assert tessera.tessera_error_status(error) == status
    tessera.tessera_error_free(error)
    raise failure


class Handle:
    """What the library made, freed with the object."""

    def __init__(self, free, function, *arguments):
        self.value, self.free = c.c_void_p(), free
        call(function, *arguments, c.byref(self.value))

    def __del__(self):
        getattr(tessera, self.free)(self.value)


def image(function, *arguments):
    return Handle("tessera_image_free", function, *arguments)


def parameters(operation, line):
    made = Handle("tessera_parameters_free", "tessera_parameters_new", operation)
    call("tessera_parameters_parse", made.value, line)
    return made


def picture(k):
    values = [float((7 * x + 13 * y + 5 * ch + 11 * k + x * y) % 32) / 32
              for y in range(HEIGHT) for x in range(WIDTH) for ch in range(CHANNELS)]
    data = (c.c_float * len(values))(*values)
    pixels = Pixels(data=c.addressof(data), window=Window(0, 0, WIDTH, HEIGHT), channels=CHANNELS, type=FLOAT)
    return image("tessera_image_copy", c.byref(pixels), None)


def info_of(handle):
    info = ImageInfo()
    call("tessera_image_get_info", handle.value, c.byref(info))
    return info


def rendered(handle, options=None):
    """The bytes of all pixels."""
    info = info_of(handle)
    w = info.data_window
    data = c.create_string_buffer(max(1, (w.x1 - w.x0) * (w.y1 - w.y0) * info.channels * 4))
    pixels = Pixels(data=c.addressof(data), window=w, channels=info.channels, type=FLOAT)
    call("tessera_render", handle.value, c.byref(pixels), c.byref(options) if options else None)
    return data.raw[:(w.x1 - w.x0) * (w.y1 - w.y0) * info.channels * 4]


def applied(values, inputs):
    handles = (c.c_void_p * len(inputs))(*[i.value for i in inputs])
    # The count is a size_t: ctypes would pass an int.
    return image("tessera_apply", values.value, handles, c.c_size_t(len(inputs)))


def fnv(data):
    value = 14695981039346656037
    for byte in data:
        value = (value ^ byte) * 1099511628211 & 0xffffffffffffffff
    return value


def every_row_is_what_cpp_computes():
    rows = 0
    for line in open(ROWS):
        name, *numbers, want = line.split()
        operation = tessera.tessera_operation_find(name.encode())
        assert operation, name
        operation = c.c_void_p(operation)
        info = OperationInfo()
        call("tessera_operation_get_info", operation, c.byref(info))
        values = parameters(name.encode(), tessera.tessera_operation_example(operation, c.c_size_t(0)))
        if info.generator:
            window = Window(0, 0, WIDTH, HEIGHT)
            result = image("tessera_generate", values.value, c.byref(window), CHANNELS)
        else:
            count = c.c_size_t()
            call("tessera_parameters_images", values.value, c.byref(count))
            result = applied(values, [picture(k) for k in range(count.value)])
        found = info_of(result)
        w = found.data_window
        assert [w.x0, w.y0, w.x1, w.y1, found.channels] == [int(n) for n in numbers], name
        assert fnv(rendered(result)) == int(want, 16), f"{name}: other bits than in C++"
        rows += 1
    assert rows > 100, rows


def everything_is_enumerated():
    names = set()
    for index in range(tessera.tessera_operation_count()):
        operation = c.c_void_p(tessera.tessera_operation_at(index))
        info = OperationInfo()
        call("tessera_operation_get_info", operation, c.byref(info))
        names.add(info.name.decode())
        info.help.decode(), info.bound.decode()
        for k in range(info.parameters):
            parameter = ParameterInfo()
            call("tessera_parameter_get_info", operation, c.c_size_t(k), c.byref(parameter))
            words = [tessera.tessera_parameter_choice(operation, c.c_size_t(k), c.c_size_t(n))
                     for n in range(parameter.choices)]
            assert parameter.name and parameter.help and None not in words, info.name
            if words and not parameter.required:  # "": what the others ask for
                assert parameter.numbers_too or parameter.default_value in words + [b""], (info.name, parameter.name)
    assert {"saturate", "blur", "colorconvert", "volume"} <= names


def refusal(action):
    try:
        action()
    except Failure as failure:
        return failure
    raise AssertionError("was accepted")


def errors_are_values():
    failure = refusal(lambda: parameters(b"saturat", b"1"))
    assert failure.status == USAGE and "saturate" in str(failure), failure
    failure = refusal(lambda: parameters(b"saturate", b"much"))
    assert failure.status == USAGE and failure.subject == "saturate", failure
    failure = refusal(lambda: image("tessera_read", b"/no/such.exr", None))
    assert failure.status == DATA and failure.subject == "/no/such.exr", failure
    blur = parameters(b"blur", b"")
    failure = refusal(lambda: call("tessera_set_text", blur.value, b"border", b"wal"))
    assert failure.status == USAGE and failure.subject == "blur:wrap" and "expected" in str(failure), failure


def progress_is_told_and_cancels():
    ramp = parameters(b"ramp", b"")  # kept: a handle is freed with its object
    soft = applied(parameters(b"blur", b"sigma=2"), [
        image("tessera_generate", ramp.value, c.byref(Window(0, 0, 900, 900)), 3)])
    shares = []
    going = PROGRESS(lambda share, user: shares.append(share) or 1)
    whole = rendered(soft, RenderOptions(progress=going))
    assert shares == sorted(shares) and shares[-1] == 1, shares[-3:]
    stop = PROGRESS(lambda share, user: 0)
    assert refusal(lambda: rendered(soft, RenderOptions(progress=stop))).status == CANCELLED
    assert rendered(soft, RenderOptions(threads=1, memory=16 << 20)) == whole
    # From several threads at once.
    equal = []
    threads = [threading.Thread(target=lambda: equal.append(rendered(soft) == whole)) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert equal == [True] * 3


def regions_are_those_of_the_whole():
    context = Handle("tessera_context_free", "tessera_context_new", None)
    soft = applied(parameters(b"blur", b"sigma=2"), [applied(parameters(b"curve", b"srgb"), [picture(4)])])
    options = RenderOptions(context=context.value)
    prepared = Handle("tessera_prepared_free", "tessera_prepare", soft.value, c.byref(options))
    row = (c.c_float * (WIDTH * CHANNELS))()
    whole, parts = rendered(soft, options), b""
    for y in range(HEIGHT):
        pixels = Pixels(data=c.addressof(row), window=Window(0, y, WIDTH, y + 1), channels=CHANNELS, type=FLOAT)
        call("tessera_prepared_render", prepared.value, c.byref(pixels), None, None)
        parts += bytes(row)
    assert parts == whole == rendered(soft)
    use = ContextUse()
    call("tessera_context_get_use", context.value, c.byref(use))
    assert use.entries > 0, use.entries


def files_come_back():
    file = os.path.join(FOLDER, "foreign_test.tif").encode()
    first = picture(2)
    call("tessera_write", first.value, file, None)
    assert rendered(image("tessera_read", file, None)) == rendered(first)
    os.remove(file)


def graphs_are_data():
    first = picture(3)
    line = applied(parameters(b"blur", b"sigma=2"), [image("tessera_image_as_input", first.value, b"plate")])
    both = applied(parameters(b"add", b""), [line, picture(1)])
    text = c.c_void_p()
    call("tessera_graph_to_json", both.value, c.byref(text))
    json = c.string_at(text)
    tessera.tessera_text_free(text)
    names = []
    while True:
        name = c.c_void_p()
        call("tessera_graph_input", json, c.c_size_t(len(names)), c.byref(name))
        if not name:
            break
        names.append(c.string_at(name))
        tessera.tessera_text_free(name)
    assert names == [b"plate", b"image"], names
    images = [first, picture(1)]
    back = image("tessera_graph_from_json", json, (c.c_char_p * 2)(*names),
                 (c.c_void_p * 2)(*[i.value for i in images]), c.c_size_t(2))
    assert rendered(back) == rendered(both)
    failure = refusal(lambda: image("tessera_graph_from_json", b"{}", None, None, c.c_size_t(0)))
    assert failure.status == DATA and "tessera_graph" in str(failure), failure
    failure = refusal(lambda: image("tessera_graph_from_json", json, None, None, c.c_size_t(0)))
    assert failure.status == USAGE and failure.subject == "plate", failure
    failure = refusal(lambda: call("tessera_graph_to_json", None, c.byref(text)))
    assert failure.status == USAGE, failure


print("tessera", tessera.tessera_version().decode(), "C interface", tessera.tessera_c_version())
for test in (everything_is_enumerated, every_row_is_what_cpp_computes, errors_are_values,
             graphs_are_data, progress_is_told_and_cancels, regions_are_those_of_the_whole, files_come_back):
    test()
    print("ok", test.__name__)

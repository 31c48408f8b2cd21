"""Makes a wheel of what CMake builds: the hooks of PEP 517, with the standard library alone.

Settings (pip install . --config-settings NAME=VALUE):
    build-dir   where CMake builds; build/wheel
    package     a folder that holds the built package already: nothing is built
"""
import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))


def _version():
    with open(os.path.join(ROOT, "CMakeLists.txt"), encoding="utf-8") as file:
        return re.search(r"project\(tessera VERSION ([0-9.]+)", file.read()).group(1)


def _built(settings):
    """The folder of the built package."""
    folder = settings.get("package")
    if folder:
        return folder
    build = os.path.abspath(settings.get("build-dir") or os.path.join(ROOT, "build", "wheel"))
    configure = ["cmake", "-S", ROOT, "-B", build, f"-DPython_EXECUTABLE={sys.executable}", "-DTESSERA_PYTHON=ON"]
    if not os.path.exists(os.path.join(build, "CMakeCache.txt")):
        configure += ["-DCMAKE_BUILD_TYPE=Release", "-DTESSERA_TESTS=OFF", "-DTESSERA_BENCH=OFF",
                      "-DTESSERA_SAMPLES=OFF"]
        configure += ["-G", "Ninja"] if shutil.which("ninja") else []
    subprocess.run(configure, check=True)
    subprocess.run(["cmake", "--build", build, "--target", "tessera_python", "--parallel"], check=True)
    return os.path.join(build, "python", "tessera")


def _tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-" + re.sub(r"[-.]", "_", sysconfig.get_platform())


def _metadata(version):
    with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
        readme = file.read()
    return (f"Metadata-Version: 2.1\nName: tessera\nVersion: {version}\n"
            "Summary: Image-space work on CPUs, lazily, fused, tile by tile, to a stated error\n"
            "Requires-Python: >=3.8\nRequires-Dist: numpy\nDescription-Content-Type: text/markdown\n\n" + readme)


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package, version, tag = _built(config_settings or {}), _version(), _tag()
    info = f"tessera-{version}.dist-info"
    files = {}
    for name in sorted(os.listdir(package)):
        path = os.path.join(package, name)
        # A build folder that served another Python holds that one's module, too.
        foreign = name.startswith("_core.") and name != "_core" + sysconfig.get_config_var("EXT_SUFFIX")
        if os.path.isfile(path) and not foreign:
            with open(path, "rb") as file:
                files[f"tessera/{name}"] = file.read()
    files[f"{info}/METADATA"] = _metadata(version).encode()
    files[f"{info}/WHEEL"] = (f"Wheel-Version: 1.0\nGenerator: tessera_build\nRoot-Is-Purelib: false\nTag: {tag}\n"
                              ).encode()
    record = ""
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(data)}\n"
    files[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    wheel = f"tessera-{version}-{tag}.whl"
    with zipfile.ZipFile(os.path.join(wheel_directory, wheel), "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            item = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            item.external_attr = (0o755 if name.endswith(".so") else 0o644) << 16
            item.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(item, data)
    return wheel


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("no source distribution is made: pip install from the tree itself")

# SPDX-License-Identifier: Zlib
"""Builds the package vps as a wheel by CMake, for pip (PEP 517). Only Python's own modules are needed.

Without the baker or vps.World: pip install ./runtime/python --config-settings bake=off --config-settings bullet=off
"""
import base64
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MEMORY_PER_COMPILER = 2e9  # CGAL's headers need over a gigabyte


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """Called by pip before it builds. @return the name of the folder that was written"""
    folder = Path(metadata_directory, _info())
    folder.mkdir()
    for name, data in _metadata(_parts(config_settings)).items():
        Path(metadata_directory, name).write_bytes(data)
    return folder.name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Called by pip. @return the name of the wheel, which lies in wheel_directory"""
    parts = _parts(config_settings)
    with tempfile.TemporaryDirectory() as folder:
        _build_into(Path(folder), parts)
        files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in Path(folder, "vps").iterdir()}
    files.update(_metadata(parts))
    record = "".join(f"{name},sha256={_digest(data)},{len(data)}\n" for name, data in files.items())
    files[f"{_info()}/RECORD"] = (record + f"{_info()}/RECORD,,\n").encode()
    wheel = f"vps-{_version()}-{_tag()}.whl"
    with zipfile.ZipFile(Path(wheel_directory, wheel), "w", zipfile.ZIP_DEFLATED) as out:
        for name, data in files.items():
            out.writestr(name, data)
    return wheel


def _parts(config_settings):
    """The extension modules of the wheel: component of the installation -> target."""
    parts = {"python": "vps_python"}
    for setting in ("bake", "bullet"):
        choice = (config_settings or {}).get(setting, "on")
        if choice not in ("on", "off"):
            raise SystemExit(f"--config-settings {setting}={choice}: on or off")
        if choice == "on":
            parts[f"python_{setting}"] = f"vps_python_{setting}"
    return parts


def _version():
    return re.search(r"project\(vpsbake VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def _info():
    return f"vps-{_version()}.dist-info"


def _tag():
    return f"{_abi()}-{_abi()}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def _metadata(parts):
    """The files of the folder dist-info but the record, by name."""
    licences = ["Zlib", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause"]
    licences += ["MIT"] * (len(parts) > 1) + ["GPL-3.0-or-later"] * ("python_bake" in parts)
    files = {f"{_info()}/{licence}.txt": (ROOT / "LICENSES" / f"{licence}.txt").read_bytes() for licence in licences}
    files[f"{_info()}/METADATA"] = f"""Metadata-Version: 2.1
Name: vps
Version: {_version()}
Summary: Collision queries on assets that vpsbake bakes
License: {" AND ".join(licences)}
Requires-Python: >=3.9
Requires-Dist: numpy
""".encode()
    files[f"{_info()}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: vpsbake\nRoot-Is-Purelib: false\nTag: {_tag()}\n".encode()
    return files


def _build_into(prefix, parts):
    build = ROOT / "build" / f"wheel-{_abi()}"
    # No stale choices: compiling again is what the compiler's cache is for.
    (build / "CMakeCache.txt").unlink(missing_ok=True)
    off = ["LAB", "SHARED", "TESTS"] + [part for part in ("BAKE", "BULLET") if f"python_{part.lower()}" not in parts]
    _run("cmake", "-S", ROOT, "-B", build, "-DCMAKE_BUILD_TYPE=Release", "-DVPS_BUILD_PYTHON=ON", "-DVPS_PYTHON_DIR=.",
         f"-DPython_EXECUTABLE={sys.executable}", *(f"-DVPS_BUILD_{part}=OFF" for part in off))
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    jobs = max(1, min(os.cpu_count() or 1, int(memory / MEMORY_PER_COMPILER)))
    _run("cmake", "--build", build, "-j", jobs, "--target", *parts.values())
    for component in parts:
        _run("cmake", "--install", build, "--component", component, "--prefix", prefix, "--strip")


def _run(*command):
    subprocess.run([str(part) for part in command], check=True)


def _abi():
    return f"cp{sys.version_info.major}{sys.version_info.minor}"


def _digest(data):
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")

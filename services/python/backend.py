# SPDX-License-Identifier: BSD-3-Clause
"""Packs the wheel (PEP 517), and nothing of any registry is needed: of the module that is built for it in build/release, where
./fly has built most of it, or of --config-settings built=BUILD."""
import base64
import hashlib
import pathlib
import re
import subprocess
import sys
import sysconfig
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    build = pathlib.Path((config_settings or {}).get("built", ROOT / "build/release"))
    if not (config_settings or {}).get("built"):
        python = pathlib.Path(sys.executable).resolve()  # not that of pip's environment, which is gone afterwards
        for step in (["--preset", "release", f"-DPython_EXECUTABLE={python}"], ["--build", "--preset", "release", "--target", "backwash_python"]):
            subprocess.run(["cmake", *step], cwd=ROOT, check=True)
    version = re.search(r"project\(backwash VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    tag = f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"
    info = f"backwash-{version}.dist-info"
    module = f"backwash{sysconfig.get_config_var('EXT_SUFFIX')}"
    files = {
        module: (build / "services/python" / module).read_bytes(),
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: backwash\nVersion: {version}\nLicense: BSD-3-Clause\nRequires-Dist: numpy\n".encode(),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: backwash\nRoot-Is-Purelib: false\nTag: {tag}\n".encode(),
        f"{info}/LICENSE": (ROOT / "LICENSE").read_bytes(),
    }
    record = "".join(f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b'=').decode()},{len(content)}\n"
                     for name, content in files.items())
    name = f"backwash-{version}-{tag}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in {**files, f"{info}/RECORD": f"{record}{info}/RECORD,,\n".encode()}.items():
            wheel.writestr(path, content)
    return name

#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the packages consist of, as CycloneDX 1.5: the shared libraries that the programs name, and the headers that are
compiled in, each as the Debian package that it is of, with its version.

sbom.py [--sysroot DIR] OUT VERSION PROGRAM …     DIR: of another architecture, as toolchains/build.sh makes it
"""
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import uuid

# Libraries of which only headers are used: nothing in a program names them.
COMPILED_IN = ["libeigen3-dev", "libboost-math-dev", "libexpected-dev", "libcli11-dev", "nlohmann-json3-dev", "libspdlog-dev",
               "libtomlplusplus-dev", "libstdc++-12-dev"]


def run(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def libraries_of(program: str, sysroot: str) -> list[tuple[str, str]]:
    """Names and paths of what the loader loads, or of every library of a sysroot, whose loader does not run here."""
    if not sysroot:
        return re.findall(r"^\s*(\S+) => (\S+)", run("ldd", program), re.M)
    return [(path.name, str(path)) for folder in ("lib", "usr/lib") for depth in ("*", "*/*")
            for path in sorted(pathlib.Path(sysroot, folder).glob(f"{depth}.so.*"))]


def packages_of(program: str, sysroot: str) -> set[str]:
    """Debian packages of the libraries that a program names itself."""
    named = set(re.findall(r"\(NEEDED\).*\[(.*)\]", run("readelf", "-d", program)))
    found = set()
    for library, path in libraries_of(program, sysroot):
        if library in named:
            found.add(owner(path))
            named.remove(library)
    if named:
        raise SystemExit(f"sbom: {program}: not found: {', '.join(sorted(named))}")
    return found


def owner(path: str) -> str:
    """/lib and /usr/lib are one folder; dpkg knows a file by the name that its package had."""
    whole = pathlib.Path(path)
    names = {str(n) for n in (whole, whole.resolve())}
    for name in sorted(names | {n.removeprefix("/usr") for n in names} | {"/usr" + n for n in names}):
        query = subprocess.run(["dpkg", "-S", name], capture_output=True, text=True, check=False)
        if query.returncode == 0:
            return query.stdout.split(":")[0].split(",")[0]
    raise SystemExit(f"sbom: {path} is of no Debian package")


def component(package: str, how: str) -> dict:
    version, source, architecture = run(
        "dpkg-query", "-W", "-f=${Version}\n${source:Package}\n${Architecture}\n", package).splitlines()[:3]
    name = f"pkg:deb/debian/{package}@{version}?arch={architecture}"
    return {"type": "library", "bom-ref": name, "name": package, "version": version, "purl": name,
            "properties": [{"name": "backwash:use", "value": how}, {"name": "debian:source", "value": source}]}


def installed(package: str) -> bool:
    query = subprocess.run(["dpkg-query", "-W", "-f=${db:Status-Status}", package], capture_output=True, text=True, check=False)
    return query.stdout == "installed"


def main() -> int:
    words, sysroot = sys.argv[1:], ""
    if words[:1] == ["--sysroot"]:
        sysroot, words = "".join(words[1:2]), words[2:]
        os.environ["DPKG_ADMINDIR"] = f"{sysroot}/var/lib/dpkg"
    if len(words) < 3:
        print(__doc__, file=sys.stderr)
        return 64
    out, version, programs = pathlib.Path(words[0]), words[1], words[2:]
    linked = sorted(set().union(*(packages_of(p, sysroot) for p in programs)))
    compiled = sorted(p for p in COMPILED_IN if installed(p))
    components = [component(p, "linked") for p in linked] + [component(p, "compiled in") for p in compiled]
    whole = {"type": "application", "bom-ref": "backwash", "name": "backwash", "version": version,
             "licenses": [{"license": {"id": "BSD-3-Clause"}}]}
    content = {"metadata": {"component": whole}, "components": components,
               "dependencies": [{"ref": "backwash", "dependsOn": [c["bom-ref"] for c in components]}]}
    # Named by its content, so that equal programs have equal lists.
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    head = {"bomFormat": "CycloneDX", "specVersion": "1.5", "serialNumber": f"urn:uuid:{uuid.UUID(digest[:32])}", "version": 1}
    out.write_text(json.dumps(head | content, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

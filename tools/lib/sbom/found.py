# SPDX-License-Identifier: Apache-2.0
"""What a build holds of others: headers, libraries, tools, and the Debian packages that brought them."""
import glob
import os
import re
import subprocess

# What a program is and what is loaded for it, in the folders of a build.
PROGRAMS = {
    "toftwind": "daemon/toftwind",
    "toftwin": "tools/toftwin",
    "toftwin-convert-mesh": "libexec/toftwin/toftwin-convert-mesh",
    "libtoftwin.so": "protocol/client/libtoftwin.so",
    "libToftwin.so.0": "daemon/facades/openni2/libToftwin.so.0",
    "_toftwin (Python)": "tools/python/toftwin/_toftwin*.so",
}


class NotBuilt(Exception):
    """The build has not got what a list of its parts needs."""


def output_of(*words):
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def headers_of(build):
    """Paths of the headers outside of the build and its source that were compiled into anything but tests."""
    paths, is_of_test = set(), False
    for line in output_of("ninja", "-C", build, "-t", "deps").splitlines():
        if line.startswith("    "):
            if not is_of_test and line.startswith("    /usr/"):
                paths.add(os.path.realpath(line.strip()))
        else:
            is_of_test = line.startswith("tests/")
    if not paths:
        raise NotBuilt(f"{build}: Ninja knows of no header of the system: build it first (cmake --build {build})")
    return paths


def libraries_of(program):
    """Paths of the libraries that the loader takes for a program."""
    found = re.findall(r"=> (/\S+)|^\s(/\S+) \(", output_of("ldd", program), re.MULTILINE)
    return {os.path.realpath(one or other) for one, other in found}


def owners_of(paths):
    """Debian package of each path; a path that no package brought is left out."""
    owners = {}
    wanted = sorted(paths)
    for at in range(0, len(wanted), 500):
        # Since Debian merged /usr, packages may have the same file without it.
        some = [name for path in wanted[at:at + 500] for name in (path, path.removeprefix("/usr"))]
        said = subprocess.run(["dpkg-query", "-S", *some], capture_output=True, text=True, check=False).stdout
        for line in said.splitlines():
            package, _, path = line.partition(": ")
            if path and not package.startswith("diversion"):
                owners[path] = package.split(",")[0].split(":")[0]
    return {path: owners.get(path) or owners.get(path.removeprefix("/usr"))
            for path in wanted if path in owners or path.removeprefix("/usr") in owners}


def listed_packages(packages_file):
    """Names in tools/packages.txt that it takes to build."""
    with open(packages_file, encoding="utf-8") as file:
        rows = [line.split() for line in file if line.strip() and not line.startswith("#")]
    return [row[0] for row in rows if row[1] == "build"]


def parts_of(build, packages_file):
    """(headers, loaded by program, tools): sets of packages; of the second a dictionary of sets."""
    headers = set(owners_of(headers_of(build)).values())
    made = {name: glob.glob(os.path.join(build, path)) for name, path in PROGRAMS.items()}
    programs = {name: paths[0] for name, paths in made.items() if paths}
    for name in ("toftwind", "toftwin"):
        if name not in programs:
            raise NotBuilt(f"{build}: there is no {PROGRAMS[name]}: build it first (cmake --build {build})")
    loaded = {name: set(owners_of(libraries_of(path)).values()) for name, path in programs.items()}
    rest = set(listed_packages(packages_file)) - headers
    return headers, loaded, {package for package in rest if package not in set().union(*loaded.values())}

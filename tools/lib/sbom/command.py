# SPDX-License-Identifier: Apache-2.0
"""tools/sbom"""
import datetime
import json
import os
import re
import subprocess
import sys

from . import debian, found, notices, spdx

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "../../.."))


def version_of(build):
    with open(os.path.join(build, "CMakeCache.txt"), encoding="utf-8") as file:
        return re.search(r"^CMAKE_PROJECT_VERSION:STATIC=(.*)$", file.read(), re.MULTILINE)[1]


def release():
    """Of the Debian that this is, as "12"."""
    with open("/etc/os-release", encoding="utf-8") as file:
        said = re.search(r'^VERSION_ID="?([^"\n]*)', file.read(), re.MULTILINE)
    return said[1] if said else "sid"


def write(path, text):
    """Whole or not at all."""
    with open(path + ".part", "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(path + ".part", path)


def make(build, output):
    headers, loaded, tools = found.parts_of(build, os.path.join(ROOT, "tools/packages.txt"))
    in_programs = headers.union(*loaded.values())
    packages = debian.described(in_programs | tools)
    epoch = int(os.environ.get("SOURCE_DATE_EPOCH", datetime.datetime.now().timestamp()))
    created = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    document = spdx.document(version_of(build), created, release(), headers, loaded, tools, packages)
    os.makedirs(output, exist_ok=True)
    write(os.path.join(output, "toftwin.spdx.json"), json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    write(os.path.join(output, "THIRD-PARTY-NOTICES"),
          notices.text_of({name: one for name, one in packages.items() if name in in_programs}))
    print(f"{output}: {len(in_programs & packages.keys())} packages in {len(loaded)} programs, {len(tools & packages.keys())} tools")


def main(arguments, usage):
    if len(arguments) not in (1, 2) or arguments[0].startswith("-"):
        print(usage, file=sys.stderr)
        return 0 if arguments in (["-h"], ["--help"]) else 2
    try:
        make(arguments[0], arguments[1] if len(arguments) == 2 else os.path.join(arguments[0], "sbom"))
    except (found.NotBuilt, OSError, subprocess.CalledProcessError) as error:
        print(f"tools/sbom: {error}", file=sys.stderr)
        return 1
    return 0

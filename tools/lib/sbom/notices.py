# SPDX-License-Identifier: Apache-2.0
"""The notices that go along with programs which hold or load what others made."""
import os
import re

COMMON = "/usr/share/common-licenses"


def text_of(packages):
    """Each package with its own words, then once each licence that they leave to Debian's folder of licences."""
    lines = ["What of others is in toftwin's programs, or is loaded for them, and under which terms.", ""]
    named = set()
    for name in sorted(packages):
        package = packages[name]
        lines += ["=" * 80, f"{name} {package.version} (Debian source package {package.source})", package.homepage, "=" * 80,
                  package.text.rstrip() or f"No terms are known to dpkg; see {package.copyright_file}.", ""]
        named |= set(re.findall(COMMON + r"/([A-Za-z0-9.-]*[A-Za-z0-9])", package.text))
    # A name without a version is a link to that of the newest.
    for licence in sorted({os.path.basename(os.path.realpath(f"{COMMON}/{one}")) for one in named}):
        path = f"{COMMON}/{licence}"
        if os.path.isfile(path):
            with open(path, encoding="utf-8", errors="replace") as file:
                lines += ["=" * 80, f"The licence {licence}", "=" * 80, file.read().rstrip(), ""]
    return "\n".join(lines)

# SPDX-License-Identifier: Apache-2.0
"""What dpkg knows of a package: version, origin, and its licences from /usr/share/doc/…/copyright."""
import re
import subprocess
from dataclasses import dataclass, field

# Debian's short names of licences, as SPDX names them.
SPDX_NAMES = {
    "expat": "MIT", "mit": "MIT", "apache-2.0": "Apache-2.0", "apache-2": "Apache-2.0", "bsd-2-clause": "BSD-2-Clause",
    "bsd-3-clause": "BSD-3-Clause", "bsl-1.0": "BSL-1.0", "zlib": "Zlib", "isc": "ISC", "openssl": "OpenSSL",
    "cc0-1.0": "CC0-1.0", "mpl-2.0": "MPL-2.0", "mpl-1.1": "MPL-1.1", "unlicense": "Unlicense", "ijg": "IJG",
    "gpl-1": "GPL-1.0-only", "gpl-1+": "GPL-1.0-or-later", "gpl-2": "GPL-2.0-only", "gpl-2+": "GPL-2.0-or-later",
    "gpl-2.0": "GPL-2.0-only", "gpl-2.0+": "GPL-2.0-or-later", "gpl-3": "GPL-3.0-only", "gpl-3+": "GPL-3.0-or-later",
    "gpl-3.0": "GPL-3.0-only", "gpl-3.0+": "GPL-3.0-or-later", "lgpl-2": "LGPL-2.0-only", "lgpl-2+": "LGPL-2.0-or-later",
    "lgpl-2.0": "LGPL-2.0-only", "lgpl-2.0+": "LGPL-2.0-or-later", "lgpl-2.1": "LGPL-2.1-only", "lgpl-2.1+": "LGPL-2.1-or-later",
    "lgpl-3": "LGPL-3.0-only", "lgpl-3+": "LGPL-3.0-or-later", "lgpl-3.0": "LGPL-3.0-only", "lgpl-3.0+": "LGPL-3.0-or-later",
    "agpl-3": "AGPL-3.0-only", "agpl-3+": "AGPL-3.0-or-later", "epl-2.0": "EPL-2.0", "python-2.0": "Python-2.0",
    "libpng": "Libpng", "sleepycat": "Sleepycat", "ftl": "FTL", "x11": "X11", "epl-1.0": "EPL-1.0", "cddl-1.0": "CDDL-1.0",
    "mpl-2": "MPL-2.0", "epl-2": "EPL-2.0", "bsl-1": "BSL-1.0", "cc-by-4.0": "CC-BY-4.0", "cc-by-4": "CC-BY-4.0",
    "cc-by-sa-4.0": "CC-BY-SA-4.0", "fsfap": "FSFAP", "fsfullr": "FSFULLR", "artistic-2.0": "Artistic-2.0", "afl-2.1": "AFL-2.1", "0bsd": "0BSD", "boost-1.0": "BSL-1.0", "curl": "curl",
}


@dataclass
class Package:
    name: str
    version: str
    source: str
    architecture: str
    homepage: str
    copyright_file: str
    text: str = ""
    holders: list = field(default_factory=list)
    licence: str = "NOASSERTION"  # an SPDX expression, of all of its files
    other_texts: dict = field(default_factory=dict)  # LicenseRef-…: text


def described(names):
    """The packages of these names that are installed, by name."""
    form = "${binary:Package}\t${Version}\t${source:Package}\t${Architecture}\t${Homepage}\t${db:Status-Status}\n"
    said = subprocess.run(["dpkg-query", "-W", f"-f={form}", *sorted(names)], capture_output=True, text=True, check=False)
    packages = {}
    for line in said.stdout.splitlines():
        name, version, source, architecture, homepage, status = line.split("\t")
        name = name.split(":")[0]
        if status == "installed":
            packages[name] = Package(name, version, source, architecture, homepage, f"/usr/share/doc/{name}/copyright")
    for package in packages.values():
        read_licences(package)
    return packages


def read_licences(package):
    try:
        with open(package.copyright_file, encoding="utf-8", errors="replace") as file:
            package.text = file.read()
    except OSError:
        return
    paragraphs = [fields_of(part) for part in re.split(r"\n[ \t]*\n", package.text)]
    if not any("format" in fields for fields in paragraphs[:1]):
        return  # prose for people: its text is in the notices
    texts = {}
    for fields in paragraphs:
        if "license" in fields:
            short, _, text = fields["license"].partition("\n")
            if text.strip():
                texts[short.strip().lower()] = text
    expressions = []
    for fields in paragraphs:
        if "files" not in fields or "license" not in fields or fields["files"].split() == ["debian/*"]:
            continue
        package.holders += [line.strip() for line in fields.get("copyright", "").splitlines() if line.strip()]
        expression = expression_of(fields["license"].partition("\n")[0].strip(), texts, package)
        if expression and expression not in expressions:
            expressions.append(expression)
    package.holders = list(dict.fromkeys(package.holders))
    if expressions:
        package.licence = " AND ".join(f"({one})" if " OR " in one and len(expressions) > 1 else one for one in expressions)


def fields_of(paragraph):
    """Fields of a paragraph of such a file, names in small letters; a line that is indented goes on with the field."""
    fields, name = {}, None
    for line in paragraph.splitlines():
        started = re.match(r"([A-Za-z-]+):[ \t]*(.*)", line)
        if started and not line.startswith((" ", "\t")):
            name = started[1].lower()
            fields[name] = started[2]
        elif name:
            fields[name] += "\n" + line
    return fields


def expression_of(short, texts, package):
    """Debian's words for licences as an SPDX expression: "and" binds more than "or", and less where a comma is before it."""
    groups = [alternatives_of(part, texts, package) for part in re.split(r",\s*and\s+", short)]
    groups = [one for one in groups if one]
    return " AND ".join(f"({one})" if " OR " in one and len(groups) > 1 else one for one in groups)


def alternatives_of(words, texts, package):
    parts = []
    for at, word in enumerate(re.split(r"(?:,\s*)?\b(and/or|and|or)\b", words)):
        word = word.strip(" ,")
        if at % 2 == 1:
            parts.append("AND" if word == "and" else "OR")
        elif word:
            parts.append(one_licence(word, texts, package))
    while parts and parts[-1] in ("AND", "OR"):
        parts.pop()
    return " ".join(parts)


def one_licence(word, texts, package):
    name, _, exception = word.partition(" with ")
    known = SPDX_NAMES.get(name.strip().lower())
    if known and not exception:
        return known
    reference = "LicenseRef-Debian-" + re.sub(r"[^A-Za-z0-9.-]+", "-", f"{package.source}-{word}").strip("-")
    package.other_texts[reference] = texts.get(word.lower()) or f"{word}: see {package.copyright_file} of {package.name} {package.version}"
    return reference

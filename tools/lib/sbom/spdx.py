# SPDX-License-Identifier: Apache-2.0
"""An SPDX 2.3 document of what found.py found (spdx.github.io/spdx-spec/v2.3)."""
import hashlib
import re


def identifier(kind, name):
    return f"SPDXRef-{kind}-" + re.sub(r"[^A-Za-z0-9.-]", "-", name.replace("+", "plus"))


def own_package(name, version):
    return {"name": name, "SPDXID": identifier("Program", name), "versionInfo": version, "downloadLocation": "NOASSERTION",
            "filesAnalyzed": False, "licenseConcluded": "Apache-2.0", "licenseDeclared": "Apache-2.0",
            "copyrightText": "Copyright 2026 the toftwin maintainers", "supplier": "NOASSERTION"}


def debian_package(package, release):
    purl = f"pkg:deb/debian/{package.name.replace('+', '%2B')}@{package.version.replace('+', '%2B').replace(':', '%3A')}"
    entry = {"name": package.name, "SPDXID": identifier("Package", package.name), "versionInfo": package.version,
             "supplier": "Organization: Debian", "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
             "licenseConcluded": "NOASSERTION", "licenseDeclared": package.licence,
             "copyrightText": "\n".join(package.holders) or "NOASSERTION", "sourceInfo": f"Debian source package {package.source}",
             "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                               "referenceLocator": f"{purl}?arch={package.architecture}&distro=debian-{release}"}]}
    if package.homepage:
        entry["homepage"] = package.homepage
    return entry


def related(this, kind, that):
    return {"spdxElementId": this, "relationshipType": kind, "relatedSpdxElement": that}


def document(version, created, release, headers, loaded, tools, packages):
    """`packages`: debian.Package by name; those in the other sets that it lacks are left out."""
    root = identifier("Program", "toftwin-sources")
    own = [own_package("toftwin sources", version)] + [own_package(name, version) for name in loaded]
    own[0]["SPDXID"] = root
    relations = [related("SPDXRef-DOCUMENT", "DESCRIBES", one["SPDXID"]) for one in own]
    relations += [related(one["SPDXID"], "GENERATED_FROM", root) for one in own[1:]]
    for name in sorted(headers & packages.keys()):
        relations.append(related(root, "DEPENDS_ON", identifier("Package", name)))
    for program, names in loaded.items():
        for name in sorted(names & packages.keys()):
            relations.append(related(identifier("Program", program), "DYNAMIC_LINK", identifier("Package", name)))
    for name in sorted(tools & packages.keys()):
        relations.append(related(identifier("Package", name), "BUILD_TOOL_OF", root))
    texts = {}
    for package in packages.values():
        texts.update(package.other_texts)
    entries = own + [debian_package(packages[name], release) for name in sorted(packages)]
    mark = hashlib.sha256("\n".join(f"{one['name']} {one['versionInfo']}" for one in entries).encode()).hexdigest()[:16]
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"toftwin-{version}",
            "documentNamespace": f"https://spdx.org/spdxdocs/toftwin-{version}-{mark}",
            "creationInfo": {"created": created, "creators": [f"Tool: toftwin-sbom-{version}"]},
            "packages": entries, "relationships": relations,
            "hasExtractedLicensingInfos": [{"licenseId": name, "extractedText": text.strip()} for name, text in sorted(texts.items())]}

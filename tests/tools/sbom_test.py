# SPDX-License-Identifier: Apache-2.0
"""sbom_test.py SOURCE BUILD: tools/sbom makes an SPDX document that is valid, and in which nothing is missing."""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE, BUILD = sys.argv[1], sys.argv[2]
sys.path.insert(0, os.path.join(SOURCE, "tools/lib"))
from sbom import debian, found  # noqa: E402  pylint: disable=wrong-import-position

RELATIONS = {"DESCRIBES", "DEPENDS_ON", "DYNAMIC_LINK", "BUILD_TOOL_OF", "GENERATED_FROM"}


class Document(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            cls.run_into(folder)
            with open(os.path.join(folder, "toftwin.spdx.json"), encoding="utf-8") as file:
                cls.text = file.read()
            with open(os.path.join(folder, "THIRD-PARTY-NOTICES"), encoding="utf-8") as file:
                cls.notices = file.read()
        cls.document = json.loads(cls.text)
        cls.names = {one["name"]: one for one in cls.document["packages"]}
        cls.headers, cls.loaded, cls.tools = found.parts_of(BUILD, os.path.join(SOURCE, "tools/packages.txt"))

    @staticmethod
    def run_into(folder):
        environment = dict(os.environ, SOURCE_DATE_EPOCH="1700000000")
        subprocess.run([os.path.join(SOURCE, "tools/sbom"), BUILD, folder], check=True, env=environment, stdout=subprocess.DEVNULL)

    def test_it_has_all_that_spdx_2_3_wants_of_a_document(self):
        document = self.document
        self.assertEqual((document["spdxVersion"], document["dataLicense"], document["SPDXID"]),
                         ("SPDX-2.3", "CC0-1.0", "SPDXRef-DOCUMENT"))
        self.assertRegex(document["documentNamespace"], r"^https?://[^#\s]+$")
        self.assertEqual(document["creationInfo"]["created"], "2023-11-14T22:13:20Z")
        self.assertRegex(document["creationInfo"]["creators"][0], r"^(Tool|Person|Organization): \S")

    def test_identifiers_are_unique_and_of_the_letters_that_are_allowed(self):
        identifiers = [one["SPDXID"] for one in self.document["packages"]]
        self.assertEqual(len(identifiers), len(set(identifiers)))
        for one in identifiers:
            self.assertRegex(one, r"^SPDXRef-[A-Za-z0-9.-]+$")

    def test_relations_are_between_what_is_there(self):
        there = {one["SPDXID"] for one in self.document["packages"]} | {"SPDXRef-DOCUMENT"}
        for one in self.document["relationships"]:
            self.assertIn(one["spdxElementId"], there)
            self.assertIn(one["relatedSpdxElement"], there)
            self.assertIn(one["relationshipType"], RELATIONS)

    def test_licences_are_expressions_of_names_that_are_known(self):
        known = set(debian.SPDX_NAMES.values()) | {one["licenseId"] for one in self.document["hasExtractedLicensingInfos"]}
        for package in self.document["packages"]:
            for key in ("licenseDeclared", "licenseConcluded"):
                expression = package[key]
                if expression == "NOASSERTION":
                    continue
                words = re.findall(r"\(|\)|[^\s()]+", expression)
                self.assertTrue({one for one in words if one not in ("AND", "OR", "(", ")")} <= known, expression)
                self.assertRegex(re.sub(r"[^\s()]+", "x", re.sub(r"\b(AND|OR)\b", "&", expression)), r"^[x&\s()]+$")
        for one in self.document["hasExtractedLicensingInfos"]:
            self.assertRegex(one["licenseId"], r"^LicenseRef-[A-Za-z0-9.-]+$")
            self.assertTrue(one["extractedText"])

    def test_every_package_that_was_compiled_in_or_is_loaded_is_named_with_version_and_terms(self):
        for name in self.headers.union(*self.loaded.values()):
            package = self.names[name]
            self.assertTrue(package["versionInfo"], name)
            self.assertIn(f"\n{name} {package['versionInfo']} ", self.notices)
        for name in ("libfmt-dev", "libflatbuffers-dev", "libeigen3-dev", "libssl3", "libembree3-3"):
            self.assertIn(name, self.names)

    def test_all_that_it_takes_to_build_is_named(self):
        listed = found.listed_packages(os.path.join(SOURCE, "tools/packages.txt"))
        installed = debian.described(listed)
        self.assertEqual([name for name in listed if name in installed and name not in self.names], [])

    def test_the_notices_have_the_text_of_every_licence_that_they_name(self):
        for licence in re.findall(r"/usr/share/common-licenses/([A-Za-z0-9.-]*[A-Za-z0-9])", self.notices):
            path = os.path.realpath(f"/usr/share/common-licenses/{licence}")
            if os.path.isfile(path):
                self.assertIn(f"The licence {os.path.basename(path)}\n", self.notices)

    def test_the_same_build_gives_the_same_document(self):
        with tempfile.TemporaryDirectory() as folder:
            self.run_into(folder)
            with open(os.path.join(folder, "toftwin.spdx.json"), encoding="utf-8") as file:
                self.assertEqual(file.read(), self.text)


for tool in ("ninja", "ldd", "dpkg-query"):
    if subprocess.run(["sh", "-c", f"command -v {tool}"], stdout=subprocess.DEVNULL, check=False).returncode != 0:
        print(f"SKIP: there is no {tool} here")
        sys.exit(77)
unittest.main(argv=sys.argv[:1])

# SPDX-License-Identifier: Apache-2.0
"""Makes a header of what a stub says: docs_header.py STUB HEADER

The header has an array `kDocs` of pairs: a name such as "Client.stream", and its words."""
import ast
import json
import sys


def said_in(nodes, inside=""):
    """(name, words) of classes, functions and properties. A class's words are those of its __init__, too."""
    for node in nodes:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            name, words = inside + node.name, ast.get_docstring(node)
            if words:
                yield name, words
            if isinstance(node, ast.ClassDef):
                yield from said_in(node.body, name + ".")


def main(stub, header):
    with open(stub, encoding="utf-8") as file:
        said = list(said_in(ast.parse(file.read()).body))
    rows = "".join(f"    std::pair<std::string_view, const char*>{{{json.dumps(name)}, {json.dumps(words)}}},\n" for name, words in said)
    text = ("#pragma once\n#include <array>\n#include <string_view>\n#include <utility>\nnamespace toftwin::python {\n"
            f"inline constexpr std::array kDocs{{\n{rows}}};\n}}\n")
    with open(header, "w", encoding="utf-8") as file:
        file.write(text)


main(*sys.argv[1:])

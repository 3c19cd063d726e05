#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails where units of a folder include each other in a circle, and where a folder has too many units.

A unit is a header with the source of the same name. Exceptions are lines of a file: "circles FOLDER" or "units FOLDER",
for folders that are not yet in order.

    units.py ROOT EXCEPTIONS MOST FOLDER…
"""
import collections
import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)\.h"', re.M)


def units_of(root, folders):
    """Each unit with the units that it includes."""
    included = collections.defaultdict(set)
    for folder in folders:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".h", ".cpp"):
                unit = str(file.relative_to(root).with_suffix(""))
                included[unit] |= set(INCLUDE.findall(file.read_text(encoding="utf-8")))
    return {unit: (others & included.keys()) - {unit} for unit, others in included.items()}


def circles(graph):
    """Strongly connected units, two or more (Tarjan, SIAM J. Comput. 1 (1972) 146)."""
    number, low, stack, found = {}, {}, [], []

    def visit(unit):
        number[unit] = low[unit] = len(number)
        stack.append(unit)
        for other in graph[unit]:
            if other not in number:
                visit(other)
                low[unit] = min(low[unit], low[other])
            elif other in stack:
                low[unit] = min(low[unit], number[other])
        if low[unit] == number[unit]:
            start = stack.index(unit)
            found.append(sorted(stack[start:]))
            del stack[start:]

    sys.setrecursionlimit(100_000)
    for unit in graph:
        if unit not in number:
            visit(unit)
    return [circle for circle in found if len(circle) > 1]


def folder_of(unit):
    return unit.rpartition("/")[0]


def main(root, exceptions, most, folders):
    excused = {"circles": set(), "units": set()}
    for line in pathlib.Path(exceptions).read_text(encoding="utf-8").splitlines():
        kind, _, folder = line.partition("#")[0].strip().partition(" ")
        if kind:
            excused[kind].add(folder.strip())
    graph = units_of(pathlib.Path(root), folders)
    wrong = [f"circle of {len(circle)} units: {', '.join(circle)}: move the types that they share into a header of their own"
             for circle in circles(graph) if not {folder_of(unit) for unit in circle} <= excused["circles"]]
    wrong += [f"{folder} has {count} units, at most {most} are wanted: divide it by what its parts do"
              for folder, count in collections.Counter(map(folder_of, graph)).items()
              if count > int(most) and folder not in excused["units"]]
    print("\n".join(wrong) if wrong else f"{len(graph)} units in order")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], sys.argv[3], sys.argv[4:]))

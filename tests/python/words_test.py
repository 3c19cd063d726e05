# SPDX-License-Identifier: Apache-2.0
"""The stub names what there is, and everything says what it is."""
import ast
import inspect
import os
import unittest

import toftwin

STUB = os.path.join(os.path.dirname(toftwin.__file__), "__init__.pyi")


def public(holder):
    return {name for name in vars(holder) if not name.startswith("_")}


def stubbed():
    """Functions, and classes with their members, of the stub."""
    with open(STUB, encoding="utf-8") as file:
        nodes = ast.parse(file.read()).body
    functions = {node.name for node in nodes if isinstance(node, ast.FunctionDef)}
    classes = {node.name: {one.name for one in node.body if isinstance(one, ast.FunctionDef)} for node in nodes
               if isinstance(node, ast.ClassDef) and node.bases == [] or isinstance(node, ast.ClassDef) and node.name == "Error"}
    return functions, classes


class Words(unittest.TestCase):
    def test_the_stub_has_every_function_and_no_other(self):
        functions, _ = stubbed()
        there = {name for name in toftwin.__all__ if not inspect.isclass(getattr(toftwin, name))}
        self.assertEqual(functions, there)

    def test_the_stub_has_every_class_with_all_members(self):
        _, classes = stubbed()
        self.assertEqual(set(classes), {name for name in toftwin.__all__ if inspect.isclass(getattr(toftwin, name))})
        for name, members in classes.items():
            thing = getattr(toftwin, name)
            if name == "Error":
                continue
            self.assertEqual({one for one in members if not one.startswith("_")}, public(thing), name)
            for special in (one for one in members if one.startswith("__")):
                self.assertTrue(hasattr(thing, special), f"{name}.{special}")

    def test_everything_says_what_it_is(self):
        silent = [name for name in toftwin.__all__ if not (inspect.getdoc(getattr(toftwin, name)) or "").strip()]
        for name in toftwin.__all__:
            thing = getattr(toftwin, name)
            if inspect.isclass(thing) and name != "Error":
                silent += [f"{name}.{one}" for one in public(thing) if not (inspect.getdoc(getattr(thing, one)) or "").strip()]
        self.assertEqual(silent, [])

    def test_python_functions_have_the_stubs_parameters(self):
        with open(STUB, encoding="utf-8") as file:
            nodes = [node for node in ast.parse(file.read()).body if isinstance(node, ast.FunctionDef)]
        for node in nodes:
            function = getattr(toftwin, node.name)
            if inspect.isfunction(function):
                arguments = node.args
                named = [one.arg for one in arguments.args + arguments.kwonlyargs]
                there = [one.name for one in inspect.signature(function).parameters.values() if one.kind is not one.VAR_KEYWORD]
                self.assertEqual(named, there, node.name)


unittest.main()

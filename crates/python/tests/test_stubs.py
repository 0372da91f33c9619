"""The stubs name what the module has, with its parameters, and everything has a docstring."""

import ast
import inspect
import unittest
from pathlib import Path

import hpu
from hpu import _hpu

# What classes have without us.
OF_OBJECT = set(dir(object)) | {"__module__"}


def parameters(function):
    arguments = function.args
    names = [argument.arg for argument in arguments.posonlyargs + arguments.args + arguments.kwonlyargs]
    names += [argument.arg for argument in (arguments.vararg, arguments.kwarg) if argument]
    return {name for name in names if name not in ("self", "cls")}


class Stubs(unittest.TestCase):
    def setUp(self):
        stubs = ast.parse(Path(hpu.__file__).with_name("_hpu.pyi").read_text())
        self.functions = {node.name: node for node in stubs.body if isinstance(node, ast.FunctionDef)}
        self.classes = {node.name: node for node in stubs.body if isinstance(node, ast.ClassDef)}

    def test_they_name_all_functions_and_their_parameters(self):
        found = {name: value for name, value in vars(_hpu).items() if inspect.isbuiltin(value)}
        self.assertEqual(found.keys(), self.functions.keys())
        for name, function in found.items():
            self.assertEqual(set(inspect.signature(function).parameters), parameters(self.functions[name]), name)

    def test_they_name_all_classes_and_their_members(self):
        found = {name: value for name, value in vars(_hpu).items() if inspect.isclass(value)}
        self.assertEqual(found.keys(), self.classes.keys())
        for name, kind in found.items():
            members = {node.name for node in self.classes[name].body if isinstance(node, ast.FunctionDef)}
            mine = set(vars(kind)) - OF_OBJECT | {"__new__"} & set(vars(kind))
            # The buffer protocol has these names from Python 3.12 on.
            self.assertEqual(mine - {"__buffer__"}, members - {"__buffer__"}, name)

    def test_everything_public_has_a_docstring(self):
        for name in hpu.__all__:
            value = getattr(hpu, name)
            self.assertTrue(inspect.getdoc(value), name)
            if inspect.isclass(value) and value.__module__ == "hpu":
                for member, what in vars(value).items():
                    if not member.startswith("_"):
                        self.assertTrue(what.__doc__, f"{name}.{member}")
        self.assertEqual(sorted(hpu.__all__), hpu.__all__)
        public = {name for name in vars(_hpu) if not name.startswith("_")}
        self.assertLessEqual(public, set(hpu.__all__))


if __name__ == "__main__":
    unittest.main()

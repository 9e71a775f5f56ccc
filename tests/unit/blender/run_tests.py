"""Run by Blender: the tests of the exporter. Exit code 77 without numpy."""
import os
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path[:0] = [HERE, os.path.join(HERE, "../../../client/blender")]

try:
    import numpy  # noqa: F401
except ImportError:
    print("Blender's Python has no numpy (deploy/setup --blender)")
    sys.exit(77)

tests = unittest.defaultTestLoader.discover(HERE, "*_test.py")
sys.exit(0 if tests.countTestCases() and unittest.TextTestRunner().run(tests).wasSuccessful() else 1)

# SPDX-License-Identifier: Apache-2.0
"""Has CMake build the module toftwin._toftwin for a wheel (pyproject.toml says how to make one)."""
import glob
import os
import re
import shutil
import subprocess

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.environ.get("TOFTWIN_SOURCE", os.path.dirname(os.path.dirname(HERE)))


def version():
    with open(os.path.join(SOURCE, "CMakeLists.txt"), encoding="utf-8") as file:
        return re.search(r"project\(toftwin VERSION (\S+)", file.read())[1]


class CMakeBuild(build_ext):
    def build_extension(self, ext):
        build = os.environ.get("TOFTWIN_PYTHON_BUILD")
        if not build:
            build = os.path.abspath(os.path.join(self.build_temp, "cmake"))
            subprocess.check_call(["cmake", "--preset", "release", "-S", SOURCE, "-B", build, "-DTOFTWIN_PYTHON=ON"], cwd=SOURCE)
            subprocess.check_call(["cmake", "--build", build, "--target", "toftwin_python"])
        made = glob.glob(os.path.join(build, "tools/python/toftwin/_toftwin*.so"))
        if len(made) != 1:
            raise RuntimeError(f"{build}: there is no module; build its target toftwin_python")
        target = self.get_ext_fullpath(ext.name)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        shutil.copyfile(made[0], target)


setup(version=version(), ext_modules=[Extension("toftwin._toftwin", sources=[])], cmdclass={"build_ext": CMakeBuild})

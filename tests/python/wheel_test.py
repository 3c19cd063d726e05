# SPDX-License-Identifier: Apache-2.0
"""`pip wheel` makes a wheel, and what is in it can be imported."""
import glob
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile

for needed in ("pip", "setuptools", "wheel"):
    if importlib.util.find_spec(needed) is None:
        print(f"SKIP: {sys.executable} has no {needed} (Debian: apt install python3-{needed})")
        sys.exit(77)

source = os.environ["TOFTWIN_SOURCE"]
with tempfile.TemporaryDirectory() as folder:
    # A copy: pip writes beside what it builds, and the source may be somebody else's.
    shutil.copytree(os.path.join(source, "tools/python"), os.path.join(folder, "python"))
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--no-index", "-q", "-w", folder,
                    os.path.join(folder, "python")], check=True)
    wheel, = glob.glob(os.path.join(folder, "toftwin-*.whl"))
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(os.path.join(folder, "unpacked"))
        names = packed.namelist()
    for wanted in ("toftwin/__init__.py", "toftwin/__init__.pyi", "toftwin/py.typed"):
        assert wanted in names, (wanted, names)
    environment = dict(os.environ, PYTHONPATH=os.path.join(folder, "unpacked"))
    code = "import toftwin; print(toftwin.__file__, toftwin.__version__, len(toftwin.cameras()))"
    said = subprocess.run([sys.executable, "-c", code], env=environment, check=True, capture_output=True, text=True).stdout
    assert folder in said and f"-{said.split()[1]}-" in os.path.basename(wheel), said

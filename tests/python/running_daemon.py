# SPDX-License-Identifier: Apache-2.0
"""toftwind as a process in a folder of a test's own."""
import os
import subprocess
import tempfile
import time

import toftwin

SOURCES = """
recording_folder = "recordings"

[[source]]
name = "pattern"
driver = "pattern"
width = 64
height = 48
pace = "fast"
planes = ["range", "depth", "amplitude", "ambient", "flags"]

[[source]]
name = "paced"
driver = "pattern"
width = 64
height = 48

[[source]]
name = "twin"
driver = "sim"
uri = "sim:o3d303"
samples_per_pixel = 1
max_surfaces = 1
pixel_extent = 0

[[source]]
name = "short"
driver = "pattern"
width = 16
height = 16
frames = 3
pace = "fast"
"""


class Daemon:
    def __init__(self, configuration=SOURCES):
        self.folder = tempfile.TemporaryDirectory(prefix="toftwin-")
        self.address = "unix:" + os.path.join(self.folder.name, "s")
        path = os.path.join(self.folder.name, "toftwind.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(configuration)
        self.log = open(os.path.join(self.folder.name, "log"), "w+", encoding="utf-8")
        self.process = subprocess.Popen([os.environ["TOFTWIND"], "--config", path, "--port", "0", "--socket", self.address[5:]],
                                        stdout=self.log, stderr=subprocess.STDOUT)
        self.wait()

    def wait(self):
        for _ in range(600):  # a loaded machine; only a broken daemon needs so long
            try:
                return toftwin.connect(self.address).close()
            except toftwin.Error:
                if self.process.poll() is not None:
                    break
                time.sleep(0.1)
        self.log.seek(0)
        raise RuntimeError("toftwind did not start:\n" + self.log.read())

    def close(self):
        self.process.terminate()
        self.process.wait()
        self.log.close()
        self.folder.cleanup()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

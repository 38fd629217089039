#!/usr/bin/env python3
"""The Dockerfile without Docker: what it copies is there and not ignored; its shell parts are shell; it builds with a
preset, options and a package that the project has; what it installs by name is Debian's; it runs the installed program,
not as root.

    container.py <source tree>
"""

import json
import pathlib
import re
import shlex
import subprocess
import sys

source = pathlib.Path(sys.argv[1])
text = re.sub(r"\\\n", "", re.sub(r"^#.*\n", "", (source / "Dockerfile").read_text(), flags=re.MULTILINE))
steps = [line.split(" ", 1) for line in text.splitlines() if line]
stages = [i for i, (word, _) in enumerate(steps) if word == "FROM"]
build, final = steps[stages[0] : stages[1]], steps[stages[1] :]
assert [steps[i][1] for i in stages] == ["debian:12-slim AS build", "debian:12-slim"], stages
ignored = (source / ".dockerignore").read_text().split()

for word, rest in build:
    if word == "COPY":
        *sources, _ = shlex.split(rest)
        for path in sources:
            assert (source / path).exists(), f"COPY {path}: not there"
            assert not any(pathlib.PurePath(path).match(pattern) for pattern in ignored), f"COPY {path}: ignored"
for path in source.glob("[!.]*"):  # the whole tree is copied but for what is built
    assert path.name.startswith("build") or not any(path.match(pattern) for pattern in ignored), f"{path} is ignored"

shell = {stage: [rest for word, rest in part if word == "RUN"] for stage, part in (("build", build), ("final", final))}
for part in sum(shell.values(), []):
    subprocess.run(["sh", "-n", "-c", part], check=True)
subprocess.run(["sh", "-n", source / "cmake/install-packages.sh"], check=True)

packaging = (source / "cmake/tiltrim_package.cmake").read_text()
(script, making) = shell["build"]
assert script.startswith("/source/cmake/install-packages.sh &&")  # the packages are those of the script
known = (source / "cmake/install-packages.sh").read_text().split()
assert "file" in known or "SHLIBDEPS ON" not in packaging, "cpack asks `file` what is a binary"
presets = {preset["name"] for preset in json.loads((source / "CMakePresets.json").read_text())["configurePresets"]}
assert set(re.findall(r"--preset (\S+)", making)) == {"release"} <= presets
options = re.findall(r"^option\((\w+)", (source / "CMakeLists.txt").read_text(), re.MULTILINE)
assert all(option in options for option in re.findall(r"-D (\w+)=", making)), making
assert "set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/package)" in packaging
assert "set(CPACK_PACKAGE_NAME tiltrim)" in packaging and "DEB-DEFAULT" in packaging
assert ["COPY", "--from=build /source/build/package/tiltrim_*.deb /tmp/"] in final

(installing,) = shell["final"]
named = re.search(r"apt-get install ([^&]*)", installing)[1].split()
packages = [word for word in named if not word.startswith(("-", "/tmp/tiltrim_"))]
recommended = re.search(r'CPACK_DEBIAN_PACKAGE_RECOMMENDS "([^"]*)"', packaging)[1].split(", ")
assert packages == recommended, f"{packages} are installed, {recommended} are recommended"
assert all(package in known for package in packages), packages

(user,) = [rest for word, rest in final if word == "USER"]
assert user != "root" and f"useradd --create-home {user}" in installing
last = dict(final)
assert json.loads(last["ENTRYPOINT"]) == ["tiltrim"] and json.loads(last["CMD"]) == ["--help"]
assert last["WORKDIR"] == "/work"

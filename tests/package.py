#!/usr/bin/env python3
"""The Debian package: built, without an error of lintian's, and used where it is unpacked: the program, its data, manual
and completion; a C++ program that pkg-config compiles with one include path.

    package.py <build folder> <scratch folder> <C++ compiler> <flags>
"""

import os
import pathlib
import pty
import select
import shlex
import shutil
import subprocess
import sys
import time

sys.dont_write_bytecode = True
from packages import leave_out, skip  # noqa: E402

build, scratch = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
compiler, flags = sys.argv[3], shlex.split(" ".join(sys.argv[4:]))
for program in ("cpack", "dpkg-deb", "dpkg-shlibdeps", "pkg-config"):
    if not shutil.which(program):
        skip(program)

MAIN = """#include <tiltrim/linearize/modes.hpp>
#include <tiltrim/study/reference_vehicle.hpp>
#include <tiltrim/vehicles/tiltrotor/formulations.hpp>
#include <cstdio>
int main() {
  const tiltrim::Vehicle craft = tiltrim::reference_vehicle();
  const auto problem = tiltrim::closed_loop_problem(craft, {.V = 15.0, .gamma = 0.0, .eta = 0.0});
  const auto level = tiltrim::trim(problem.model, problem.spec, problem.guess);
  const auto linear = tiltrim::linearize(problem.model, level.point);
  std::puts(tiltrim::modes(linear).verdict == tiltrim::Verdict::stable ? "stable" : "not stable");
}
"""


def run(*command, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, **options)
    if done.returncode:
        sys.exit(f"{shlex.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


shutil.rmtree(scratch, ignore_errors=True)
scratch.mkdir(parents=True)
run("cpack", "--config", build / "CPackConfig.cmake", "-B", scratch, cwd=build)
(package,) = scratch.glob("*.deb")
about = run("dpkg-deb", "--field", package)
for library in ("coinor-libipopt", "libnlopt", "libnetcdf", "libmatio", "libfmt", "libtbb"):
    assert library in about, f"no dependency on {library}\n{about}"
if shutil.which("lintian"):
    run("lintian", "--fail-on", "error", "--allow-root", "--no-tag-display-limit", package)
else:
    leave_out("lintian")

root = scratch / "root"
run("dpkg-deb", "-x", package, root)
usr = root / "usr"
elsewhere = {k: v for k, v in os.environ.items() if k != "TILTRIM_DATA"}
trimmed = run(usr / "bin/tiltrim", "trim", usr / "share/tiltrim/studies/paper.toml", env=elsewhere, cwd=scratch)
assert trimmed.count("converged") == 3, trimmed
for file in ("man/man1/tiltrim.1.gz", "man/man1/tiltrim-sweep.1.gz", "bash-completion/completions/tiltrim",
             "zsh/vendor-completions/_tiltrim", "fish/vendor_completions.d/tiltrim.fish", "doc/tiltrim/copyright",
             "doc/tiltrim/CITATION.cff", "doc/tiltrim/docs/tutorials/1-first-trim.md", "doc/tiltrim/examples/blimp.cpp",
             "tiltrim/data/study.schema.json", "tiltrim/data/output.schema.json"):  # fmt: skip
    assert (usr / "share" / file).is_file(), file


def in_bash(typed):
    script = (f"source {usr}/share/bash-completion/completions/tiltrim; COMP_WORDS=({typed}); "
              f"COMP_CWORD={len(shlex.split(typed)) - 1}; _tiltrim; printf '%s\\n' \"${{COMPREPLY[@]}}\"")  # fmt: skip
    return run("bash", "-c", script).split()


def in_zsh(typed):
    """The last word of the line after the Tab key in an interactive shell, which ^T writes to a file."""
    line = scratch / "line"
    line.unlink(missing_ok=True)
    setup = (f"fpath=({usr}/share/zsh/vendor-completions $fpath); autoload -Uz compinit; compinit -u -D; "
             f"tell() {{ print -r -- $BUFFER > {line}.part; mv {line}.part {line} }}; "
             "zle -N tell; bindkey '^T' tell; bindkey '^I' complete-word\n")  # fmt: skip
    ours, its = pty.openpty()
    shell = subprocess.Popen(["zsh", "-f", "-i"], stdin=its, stdout=its, stderr=its, start_new_session=True,
                             env={**os.environ, "TERM": "dumb"})  # fmt: skip
    os.close(its)
    os.write(ours, f"{setup}{typed}\t\x14".encode())
    screen, end = b"", time.monotonic() + 60
    while not line.exists() and time.monotonic() < end:
        if select.select([ours], [], [], 0.02)[0]:  # the line is written after the last output: no waiting for more
            screen += os.read(ours, 65536)
    shell.kill()
    shell.wait()
    os.close(ours)
    return line.read_text().split()[-1:] if line.exists() else [screen]


def in_fish(typed):
    script = f"source {usr}/share/fish/vendor_completions.d/tiltrim.fish; complete -C '{typed}'"
    return [found.split("\t")[0] for found in run("fish", "--no-config", "-c", script).splitlines()]


# What the Tab key offers: a command, an option, a value, a study.
TYPED = {"tiltrim lin": "linearize", "tiltrim simulate --mon": "--monte-carlo", "tiltrim trim --solver ne": "newton",
         f"tiltrim trim {usr}/share/tiltrim/studies/pap": f"{usr}/share/tiltrim/studies/paper.toml"}  # fmt: skip
for shell, offers in (("bash", in_bash), ("zsh", in_zsh), ("fish", in_fish)):
    if not shutil.which(shell):
        leave_out(shell)
        continue
    for typed, offered in TYPED.items():
        found = offers(typed)
        assert found == [offered], (shell, typed, found)

(folder,) = usr.glob("lib/**/pkgconfig")
used = shlex.split(run("pkg-config", "--cflags", "--libs", "tiltrim",
                       env={**os.environ, "PKG_CONFIG_PATH": str(folder)}))  # fmt: skip
own = [word for word in used if word.startswith("-I") and str(scratch) in os.path.realpath(word[2:])]
assert len(own) == 1, used  # <prefix>/include, and no more
(scratch / "main.cpp").write_text(MAIN)
run(compiler, "-std=c++20", *flags, scratch / "main.cpp", "-o", scratch / "main", *used)
printed = run(scratch / "main", env={**elsewhere, "TILTRIM_DATA": str(usr / "share/tiltrim/data")})
assert printed == "stable\n", printed
print(f"{package.name}: {package.stat().st_size / 1e6:.1f} MB")

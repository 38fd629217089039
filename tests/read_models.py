#!/usr/bin/env python3
"""Reads the files of `linearize --models` as other programs do: read_models.py TILTRIM STUDY.toml

MAT-files with scipy.io, JSON and CSV with the standard library, Python by importing it. Every matrix
must equal the output of `linearize --format json` bit for bit. Exit code 0: they do; 1: not; 77: no
SciPy (skipped).
"""

import csv
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import types

sys.dont_write_bytecode = True
from packages import need  # noqa: E402

(np,) = need("python3-numpy", "numpy")
scipy, _, _ = need("python3-scipy", "scipy", "scipy.io", "scipy.signal")

# Names that would break out of a string literal, a row of CSV or MATLAB's rules for names.
HOSTILE = [
    'a "quote", a \\ and """',
    "'''); import os; open('harm', 'w') #",
    "{0} %s $HOME `id`",
    "Übergang ±5°",
    "rotor \U0001F681",
    "end",
    "1.5, a",
    "1;5: a",
    "x" * 70,
    "x" * 70 + "y",
]


def run(program, *arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True, check=False)


def imported(path):
    spec = importlib.util.spec_from_file_location("linear", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def same(found, expected):
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    return found.size == expected.size and found.tobytes() == expected.reshape(found.shape).tobytes()


def matrices(linear):
    return {key: linear[key] for key in ("A", "B", "C", "D")}


def check_mat(path, conditions):
    read = scipy.io.loadmat(path)
    structs = {k: v[0, 0] for k, v in read.items() if not k.startswith("__")}
    assert len(structs) == len(conditions)
    for (key, struct), (name, c) in zip(structs.items(), conditions.items()):
        assert key.isidentifier() and key.isascii() and key[0] != "_" and len(key) <= 63, key
        beyond = "".join(ch if ch < "\U00010000" else "\ufffd" for ch in name)
        assert struct["name"][0] == beyond, (struct["name"], name)
        for m, expected in matrices(c["linear"]).items():
            assert same(struct[m], expected), (name, m)
        assert same(struct["A_error"], c["linear"]["A_error"])
        for names in ("states", "inputs", "outputs"):
            assert [cell[0] for cell in struct[names][:, 0]] == c["linear"][names]
        assert same(struct["x0"], list(c["state"].values()))
        assert same(struct["y0"], list(c["output"].values()))
        assert struct["u0"].shape == (len(c["linear"]["inputs"]), 1)
        assert struct["verdict"][0] == c["verdict"]
        assert same(struct["eigenvalues"].real, [m["re"] for m in c["modes"]])
        assert same(struct["eigenvalues"].imag, [m["im"] for m in c["modes"]])
    return list(structs)


def check_json(path, conditions):
    with open(path, encoding="utf-8") as file:
        read = json.load(file)
    assert [m["name"] for m in read["models"]] == list(conditions)
    for model in read["models"]:
        c = conditions[model["name"]]
        for key in ("A", "B", "C", "D", "A_error", "B_error", "C_error", "D_error", "states", "inputs",
                    "outputs"):
            assert model[key] == c["linear"][key], key
        assert model["point"]["state"] == c["state"] and model["point"]["output"] == c["output"]
        assert list(model["point"]["input"]) == model["inputs"]
        assert model["verdict"] == c["verdict"]


def check_csv(path, conditions):
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    entries = {}
    for row in rows:
        entries[row["condition"], row["matrix"], row["row"], row["column"]] = row
    assert len(entries) == len(rows)
    for name, c in conditions.items():
        linear = c["linear"]
        sides = {"A": ("states", "states"), "B": ("states", "inputs"), "C": ("outputs", "states"),
                 "D": ("outputs", "inputs")}
        for m, (down, across) in sides.items():
            for i, row in enumerate(linear[down]):
                for j, column in enumerate(linear[across]):
                    entry = entries[name, m, row, column]
                    assert same(float(entry["value"]), linear[m][i][j]), (name, m, i, j)
                    assert same(float(entry["error"]), linear[m + "_error"][i][j])
        for state, value in c["state"].items():
            assert same(float(entries[name, "x0", state, ""]["value"]), value)


def check_python(path, conditions):
    with open(path, encoding="ascii"):
        pass
    linear = imported(path)
    assert linear.names == list(conditions)
    assert "scipy" not in open(path, encoding="ascii").read().split("def ")[0].split('"""')[2]
    recorded = []
    stub = types.ModuleType("control")
    stub.ss = lambda *matrices, **names: recorded.append((matrices, names)) or "system"
    for name, c in conditions.items():
        for m, expected in matrices(c["linear"]).items():
            assert same(linear.models[name][m], expected), (name, m)
        system = linear.to_scipy(name)
        assert isinstance(system, scipy.signal.StateSpace)
        assert same(system.A, c["linear"]["A"]) and same(system.B, c["linear"]["B"])
        # Two eigenvalue solvers on one matrix: apart by rounding times condition, which is below 10.
        found = np.sort_complex(np.linalg.eigvals(system.A))
        expected = np.sort_complex([complex(m["re"], m["im"]) for m in c["modes"]])
        bound = max(m["error"] for m in c["modes"])
        assert abs(found - expected).max() <= 1e-12 + bound, (found, expected)

        sys.modules["control"] = stub  # python-control is no Debian package: a stand-in
        assert linear.to_control(name) == "system"
        given, names = recorded.pop()
        assert all(same(g, e) for g, e in zip(given, matrices(c["linear"]).values()))
        dotless = {k: [s.replace(".", "_") for s in c["linear"][k]] for k in ("states", "inputs", "outputs")}
        assert names == {"name": name.replace(".", "_"), **dotless}
    return linear


def check(program, study, *more):
    files = {ending: "models" + ending for ending in (".mat", ".json", ".csv", ".py")}
    options = [word for file in files.values() for word in ("--models", file)]
    ran = run(program, "linearize", study, "--format", "json", *more, *options)
    conditions = {c["name"]: c for c in json.loads(ran.stdout)["conditions"] if "modes" in c}
    keys = check_mat(files[".mat"], conditions)
    check_json(files[".json"], conditions)
    check_csv(files[".csv"], conditions)
    linear = check_python(files[".py"], conditions)
    return conditions, keys, linear


def check_modes_of_mat(program, A):
    """`modes` reads files saved by SciPy, and refuses them truncated anywhere."""
    names = [f"x{i + 1}" for i in range(len(A))]
    np.savetxt("A.csv", A, delimiter=",", header="by numpy", fmt="%.17g")
    expected = run(program, "modes", "A.csv", "--format", "json").stdout
    assert json.loads(expected)["states"] == names
    for compressed in (False, True):
        scipy.io.savemat("A.mat", {"other": {"text": "x", "list": [1, 2]}, "A": A}, do_compression=compressed)
        assert run(program, "modes", "A.mat", "--format", "json").stdout == expected
        whole = open("A.mat", "rb").read()
        for size in range(0, len(whole) - 1, 17):
            with open("cut.mat", "wb") as file:
                file.write(whole[:size])
            ran = run(program, "modes", "cut.mat")
            assert ran.returncode == 2 and ran.stderr.startswith("tiltrim: cut.mat: "), (size, ran)
        # A changed byte in compressed data is detected by its checksum, unless it is in a name or unused.
        for at in range(len(whole) - 100, len(whole), 9) if compressed else []:
            with open("cut.mat", "wb") as file:
                file.write(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1:])
            assert run(program, "modes", "cut.mat").returncode == 2, at
    scipy.io.savemat("whole.mat", {"A": np.array([[0, 1], [-2, -3]])})
    assert run(program, "modes", "whole.mat").returncode == 0
    for array, why in ((A + 1j, "complex"), (scipy.sparse.csc_matrix(A), "sparse"), ([["a"]], "text"),
                       (np.zeros((2, 2, 2)), "3 dimensions"), ({"a": 1}, "struct")):
        scipy.io.savemat("bad.mat", {"A": array})
        ran = run(program, "modes", "bad.mat")
        assert ran.returncode == 2 and why in ran.stderr, ran


def main():
    program, study = (os.path.abspath(path) for path in sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        conditions, keys, _ = check(program, study)
        assert keys == list(conditions)  # names that MATLAB takes stay as they are
        check_modes_of_mat(program, np.array(conditions["level"]["linear"]["A"]))

        with open("hostile.toml", "w", encoding="utf-8") as file:
            for name in HOSTILE + ["too steep"]:
                V, gamma = (60, 80) if name == "too steep" else (15, 0)
                file.write(f"[[condition]]\nname = {json.dumps(name, ensure_ascii=False)}\n"
                           f"V = {V}.0\ngamma_deg = {gamma}.0\neta_deg = 0.0\n")
        conditions, keys, linear = check(program, "hostile.toml", "--inputs", "V,gains.K_Lp")
        assert list(conditions) == HOSTILE
        assert list(linear.left_out) == ["too steep"]
        assert len(set(keys)) == len(keys) and "end" not in keys
        assert not os.path.exists("harm")
    print("as expected")


if __name__ == "__main__":
    main()

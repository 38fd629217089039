# The commands a person types; CMakePresets.json says what they mean.
#   make            the release program, build/bin/tiltrim
#   make demo       install what is missing, build, trim and linearize the paper's conditions
#   make test       install what is missing, build, run the tests
#   make python     install the Python package (pip install .)
#   make help       the others
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
SOURCES = $(wildcard $(foreach d,runtime dense model trim linearize qualities follow sweep prove simulate optimize tune design check_proof vehicles vehicles/tiltrotor vehicles/xv15 flight study tables report cli tests \
            examples bench python/src,$(d)/*.cpp $(d)/*.hpp))
FUZZ_SECONDS ?= 60
# The program for MPI runs is built and tested where there is an MPI.
MPI = $(if $(shell command -v mpicxx 2>/dev/null),ON,OFF)
# So is the Python package where Debian's Python has what it needs.
PYTHON ?= python3
HAS_PYTHON = $(if $(shell pkg-config --exists pybind11 && /usr/bin/python3-config --includes >/dev/null 2>&1 && \
               /usr/bin/python3 -c 'import numpy, pytest' 2>/dev/null && echo yes),ON,OFF)
PARTS = -D TILTRIM_MPI=$(MPI) -D TILTRIM_PYTHON=$(HAS_PYTHON) $(if $(filter ON,$(HAS_PYTHON)),-D Python_EXECUTABLE=/usr/bin/python3)
# ThreadSanitizer needs a predictable address space; where the kernel lets us, ask for one.
STILL = $(shell setarch -R true 2>/dev/null && echo setarch -R)

# What a newcomer sees while it builds: steps done, of how many, and seconds since the first.
export NINJA_STATUS ?= [%f of %t, %e s] 

.PHONY: release packages demo test python package bench bench-python sanitize asan tsan fuzz planted forge oracle clang tidy format format-check figures api docs clean help
.NOTPARALLEL:

release:
	cmake --preset release
	@echo "building build/bin/tiltrim: four to seven minutes on two cores the first time"
	cmake --build --preset release -j $(JOBS) --target tiltrim

packages:
	cmake/install-packages.sh

demo:
	cmake/install-packages.sh program
	$(MAKE) release
	build/bin/tiltrim linearize studies/paper.toml
	build/bin/tiltrim tables

test: packages
	cmake --preset release $(PARTS)
	@echo "building the program and its tests: on two cores five to eight minutes the first time, then three to six to run them"
	cmake --build --preset release -j $(JOBS)
	ctest --preset release -j $(JOBS)

# The package for this Python, or another: make python PYTHON=env/bin/python
python: packages
	TILTRIM_BUILD= $(PYTHON) -m pip install .

# A Debian package of the program, the library and its headers, and a Python wheel, in build/package/.
package: packages
	cmake --preset release $(PARTS)
	cmake --build --preset release -j $(JOBS)
	cpack --config build/CPackConfig.cmake
	TILTRIM_BUILD=build $(PYTHON) -m pip wheel --no-deps --no-build-isolation --wheel-dir build/package .

bench: packages
	cmake --preset release -D TILTRIM_BENCH=ON
	cmake --build --preset release -j $(JOBS) --target tiltrim_bench
	build/bin/tiltrim_bench $(BENCH_FLAGS)

# What Python's functions cost; scipy.optimize's root and differential_evolution compared with trim and tune, numpy's eig with modes.
bench-python:
	cmake/install-packages.sh dev
	cmake --preset release $(PARTS)
	cmake --build --preset release -j $(JOBS) --target tiltrim_python tiltrim
	PYTHONPATH=build/python /usr/bin/python3 bench/python_overhead.py
	PYTHONPATH=build/python /usr/bin/python3 bench/python_scipy.py $(BENCH_FLAGS)
	PYTHONPATH=build/python /usr/bin/python3 bench/tune_scipy.py
	PYTHONPATH=build/python /usr/bin/python3 bench/modes_numpy.py

sanitize: asan tsan

asan: packages
	cmake --preset asan
	cmake --build --preset asan -j $(JOBS)
	ctest --preset asan -j $(JOBS)

tsan: packages
	cmake --preset tsan
	cmake --build --preset tsan -j $(JOBS)
	$(STILL) ctest --preset tsan -j $(JOBS)

# A million trims, 100,000 spectra and 10,000 proofs whose truth is known by construction: a quarter of an hour on two cores.
TRIMS ?= 1000000
SPECTRA ?= 100000
PROOFS ?= 10000
planted: packages
	cmake --preset release $(PARTS)
	cmake --build --preset release -j $(JOBS) --target trim_tests linearize_tests prove_tests
	tests/planted.py build/tests $(TRIMS) $(SPECTRA) $(PROOFS)

# 10,000 certificates of a proof, damaged or altered: none may be accepted.
forge: packages
	cmake --preset release $(PARTS)
	cmake --build --preset release -j $(JOBS) --target check_proof_tests
	for seed in $$(seq 10); do \
	  TILTRIM_SEED=$$seed TILTRIM_TRIALS=6.95 build/tests/check_proof_tests --source-file=*/forged_proof_test.cpp || exit 1; done

# A million random points of what is proved of a study, trimmed and linearized: a minute of processor time.
ORACLE ?= studies/prove_corridor.toml
oracle: packages
	cmake --preset release $(PARTS)
	cmake --build --preset release -j $(JOBS) --target tiltrim proof_oracle
	-build/bin/tiltrim prove $(ORACLE) --certificate build/oracle.proof
	build/tests/proof_oracle build/oracle.proof $(ORACLE) $(POINTS)

# Every reader with inputs that are made up, FUZZ_SECONDS each: with the libraries of `make asan`.
fuzz:
	cmake/install-packages.sh dev
	cmake --preset asan
	cmake --build --preset asan -j $(JOBS) --target fuzz
	tests/fuzz/run.sh build/asan/tests/fuzz $(FUZZ_SECONDS) $(JOBS)

# Another compiler's warnings; sources one by one, so that every header is compiled alone.
clang:
	cmake/install-packages.sh dev
	cmake --preset clang $(PARTS)
	cmake --build --preset clang -j $(JOBS)

# Several sources at once, which takes a third of the time; headers with the sources that include them. With
# CHANGED="trim/trim.hpp ..." only what reads these files.
tidy:
	cmake/install-packages.sh dev
	cmake --preset clang $(PARTS) -B build/tidy -D TILTRIM_UNITY=ON -D TILTRIM_TESTS=OFF
	/usr/bin/python3 cmake/changed_units.py build/tidy $(CHANGED) | \
	  xargs -r -P $(JOBS) -n 1 clang-tidy --quiet -p build/tidy

format:
	cmake/install-packages.sh dev
	clang-format -i $(SOURCES)

format-check:
	cmake/install-packages.sh dev
	clang-format --dry-run --Werror $(SOURCES)

figures: packages
	cmake --preset release -D TILTRIM_BENCH=ON
	cmake --build --preset release -j $(JOBS) --target tiltrim xv15_conversion
	sed 's/count = 241/count = 481/' studies/map_corridor.toml > build/corridor.toml
	build/bin/tiltrim sweep build/corridor.toml --format csv -o build/corridor.csv
	gnuplot docs/figures/corridor.gp
	build/bin/tiltrim envelope studies/stall.toml --only level --format csv -o build/envelope.csv
	gnuplot docs/figures/envelope.gp
	build/bin/tiltrim simulate studies/transition.toml --plots build/figures -o build/transition.txt
	cp build/figures/fig5_angles.svg docs/figures/transition.svg
	build/bin/tiltrim simulate studies/transition_as_drawn.toml --format csv -o build/as_drawn.csv
	gnuplot docs/figures/as_drawn.gp
	build/bin/xv15_conversion 1 studies/xv15_conversion.toml build/xv15_conversion.csv
	gnuplot -e 'file="build/xv15_conversion.csv"' docs/figures/xv15_conversion.gp
	build/bin/tiltrim report studies/paper.toml -o build/paper.html --figures build/figures
	sed -E 's/^ width="[0-9]+" height="[0-9]+"$$//' build/figures/locus_slow_1_climb.svg > docs/figures/locus.svg  # as wide as the text

api:
	cmake --preset release
	cmake --build --preset release --target api

# The documentation as a site; a link that leads nowhere is an error.
docs:
	cmake/install-packages.sh dev
	PYTHONDONTWRITEBYTECODE=1 mkdocs build --strict --quiet
	@echo build/site/index.html

clean:
	rm -rf build

help:
	@echo "make [release] | demo | test | python | package | bench, bench-python | sanitize (asan, tsan) | fuzz | planted | forge | oracle | clang | tidy | format | format-check | figures (gnuplot-nox) | api (doxygen) | docs (mkdocs) | clean"

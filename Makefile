# SPDX-License-Identifier: GPL-3.0-or-later
# A thin front for CMake: `make demo` and `make test` work on a Debian 12 machine that has only git, make and apt.

PACKAGES := ca-certificates ccache cmake g++ git lld ninja-build pkg-config \
  libassimp-dev libbullet-dev libbullet-extras-dev libcgal-dev libcli11-dev libeigen3-dev libfcl-dev libfmt-dev libgmp-dev libgtest-dev libhdf5-dev \
  libhwy-dev libjs-chart.js libjs-three libmpfr-dev libpng-dev libpugixml-dev libtbb-dev libtomlplusplus-dev liburdfdom-dev libxxhash-dev nlohmann-json3-dev \
  python3 python3-h5py hdf5-tools
# For the Python package, which is built where they are found.
PYTHON_PACKAGES := pybind11-dev python3-dev
# For the adapter for MuJoCo, likewise.
MUJOCO_PACKAGES := libmujoco-dev
# Only for `make fuzz`.
FUZZ_PACKAGES := clang libclang-rt-14-dev
FUZZ_SECONDS ?= 600
FUZZ_FIRST ?= 0
# Of `make trust`: the time of each of its four parts that can last as long as one likes, and the first number of their random choices.
TRUST_SECONDS ?= 600
TRUST_FIRST ?= 0
# The meshes for measuring the accuracy of queries: closed, manifold, wound outward.
ACCURACY_MESHES := $(addprefix ../shared/meshes/, \
  bunny_closed.obj armadillo_52k.off spot.obj fandisk.off gearwheel_40.stl screw_M3x10.stl nut_M3.stl shape_sorter.obj)
# Only for `make bench`: the libraries for comparison.
BENCH_PACKAGES := libbenchmark-dev libopenvdb-dev
# Only for `make paper`; Debian's Python finds Debian's matplotlib.
PAPER_PACKAGES := $(BENCH_PACKAGES) python3-matplotlib
PAPER_PYTHON ?= /usr/bin/python3
# For the tests of pages, format of sources, manual pages, completion, exports, engines and sanitizers.
TEST_PACKAGES := chromium clang clang-format fonts-dejavu-core groff-base libclang-rt-14-dev mandoc munge parallel python3-jsonschema \
  python3-numpy python3-pytest python3-vtk9 slurm-wlm zsh
# Only for `make tidy`.
TIDY_PACKAGES := clang-tidy
# Only for `make deb`.
DEB_PACKAGES := dpkg-dev file lintian
# Only for the tests of packages and of the container, in fresh systems.
SYSTEM_PACKAGES := debootstrap
# Only for `make scenes`: its pictures.
SCENE_PACKAGES := libgl1-mesa-dri python3-numpy python3-pil python3-vtk9 xauth xvfb
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
# CGAL's headers need over a gigabyte per compiler.
JOBS ?= $(shell awk -v n=$$(nproc) '/MemAvailable/ { m = int($$2 / 2000000); print m < 1 ? 1 : (m < n ? m : n) }' /proc/meminfo)
CTEST := ctest --output-on-failure --no-tests=error --output-junit tests.xml -j $(JOBS)
# run_tests(FOLDER, ARGUMENTS): runs the tests of a build that CTest's arguments select; then prints how many were skipped, and why.
run_tests = cd $(1) && rm -f tests.xml && { $(CTEST) $(2); status=$$?; \
  python3 -B $(CURDIR)/tests/support/skipped_tests.py tests.xml; exit $$status; }
PREFIX ?= /usr/local
VERSION = $(shell sed -n 's,^project.vpsbake VERSION \([0-9.]*\).*,\1,p' CMakeLists.txt)
BUNNY := build/demo/usr/share/glmark2/models/bunny.obj

COMMA := ,
# Prints what a step does, and about how many minutes it takes on two cores from scratch. Later runs compile only what changed.
say = @echo "== $(1)"

.PHONY: all install uninstall deb dist deps demo scenes bench bench-accuracy bench-scale paper corpus fuzz trust test test-dev test-sanitize test-tsan test-runtime-only test-deb test-container test-all tidy clean
all: deps
	$(call say,Building the program and the libraries: about 6 minutes the first time)
	cmake --preset release -DVPS_BUILD_SCENES=OFF -DVPS_BUILD_LAB=ON
	cmake --build --preset release -j $(JOBS)

# Installs the program, libraries, headers, and files for CMake and pkg-config; DESTDIR goes before PREFIX.
install: all
	DESTDIR="$(DESTDIR)" cmake --install build/release --prefix "$(PREFIX)"

# Removes what `make install` installed with the same PREFIX and DESTDIR.
uninstall:
	@sh cli/package/uninstall.sh "$(DESTDIR)$(PREFIX)"

# Makes the packages vpsbake, libvps0, libvps-dev and python3-vps with its parts for this release of Debian in build/packages, and checks
# them with lintian. Builds in build/release, where `make` does: after `make` only the Python package and MuJoCo's adapter may be missing.
deb: PACKAGES += $(DEB_PACKAGES) $(PYTHON_PACKAGES) $(MUJOCO_PACKAGES)
deb: deps
	$(call say,Building and packing: about a minute after make)
	cmake --preset deb
	cmake --build --preset deb -j $(JOBS)
	rm -rf build/packages
	cpack --config build/release/CPackConfig.cmake -B build/packages
	rm -rf build/packages/_CPack_Packages
	lintian --allow-root --fail-on error build/packages/*.deb

# Writes the committed files as build/vpsbake-VERSION.tar.gz, from which everything builds without git.
dist:
	@[ -e .git ] || { echo "make dist needs a clone made by git" >&2; exit 1; }
	@[ -z "$$(git status --porcelain)" ] || echo "make dist leaves out what is not committed" >&2
	mkdir -p build
	git archive --prefix=vpsbake-$(VERSION)/ -o build/vpsbake-$(VERSION).tar.gz HEAD
	@echo build/vpsbake-$(VERSION).tar.gz

# Calls apt only when a package is missing.
deps:
	@missing=; for p in $(PACKAGES); do \
	  dpkg-query -W -f '$${Status}' $$p 2>/dev/null | grep -q 'install ok installed' || missing="$$missing $$p"; done; \
	if [ -n "$$missing" ]; then \
	  echo "installing$$missing"; \
	  $(SUDO) apt-get update -q && $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $$missing; \
	fi

# Downloaded and unpacked below build/, not installed.
$(BUNNY):
	mkdir -p build/demo
	cd build/demo && apt-get download -q glmark2-data && dpkg-deb -x glmark2-data_*.deb . && rm glmark2-data_*.deb
	touch $@

demo: deps $(BUNNY)
	$(call say,Building the program$(COMMA) the Bullet plug-in and the scenes: about 7 minutes the first time)
	cmake --preset release -DVPS_BUILD_SCENES=ON -DVPS_BUILD_LAB=ON
	cmake --build --preset release -j $(JOBS) --target vpsbake bin_drop bunny_drop nut_on_bolt
	$(call say,A nut on its bolt$(COMMA) and the same made of convex pieces)
	python3 -B tests/scenes/nut_beside_hulls.py --vpsbake build/release/cli/vpsbake --scene build/release/tests/scenes/nut_on_bolt \
	  --meshes sample_meshes -o build/demo/nut_on_bolt.json
	$(call say,A bin of scans)
	python3 -B tests/scenes/bin_of_scans.py --vpsbake build/release/cli/vpsbake --scene build/release/tests/scenes/bin_drop \
	  --shared ../shared --models $(dir $(BUNNY)) -o build/demo/bin.json
	$(call say,Baking the bunny and dropping it)
	build/release/cli/vpsbake $(BUNNY) --scale 0.0775 --voxel 0.5mm -o build/demo/bunny.vps.hdf
	build/release/tests/scenes/bunny_drop build/demo/bunny.vps.hdf --motion build/demo/bunny_drop.json
	build/release/cli/vpsbake view build/demo/bunny.vps.hdf
	build/release/cli/vpsbake view --motion build/demo/nut_on_bolt.json build/demo/bin.json build/demo/bunny_drop.json -o build/demo/demo.html
	@echo
	@echo "Open in a browser: build/demo/demo.html plays what was just computed, build/demo/bunny.html shows the asset."

# Plays every scene, prints its measurements and the table of docs/scenes.md, and writes its pictures. Scenes that need ../shared are
# left out where it is absent. Takes minutes.
scenes: PACKAGES += $(SCENE_PACKAGES)
scenes: deps
	cmake --preset release -DVPS_BUILD_SCENES=ON -DVPS_BUILD_LAB=ON
	cmake --build --preset release -j $(JOBS) --target bunnies gears nut_on_bolt peg_in_hole tabletop
	xvfb-run -a /usr/bin/python3 -B tests/scenes/render.py --programs build/release/tests/scenes --work build/scenes --pictures docs/scenes

# Compares, in the same run, baking with OpenVDB, and queries and scenes with Bullet's own, HACD, GImpact and FCL. Measures the fields' errors,
# overruns of budgets, the growth of queries' costs, and the sizes of the libraries. Prints Markdown tables. The first run takes minutes more: it decomposes the
# bunny with HACD, and finds its poses with the oracle. Ends with bench-accuracy.
bench: PACKAGES += $(BENCH_PACKAGES)
bench: deps $(BUNNY)
	cmake --preset bench
	cmake --build --preset bench -j $(JOBS) --target vpsbake budget_overrun openvdb_peer field_error kernel_sweep query_bench motion_bench scene_bench growth_bench thin_faces vps_bullet
	sh tests/install/runtime_size.sh build/bench
	python3 -B tests/bench/bench_bake.py --vpsbake build/bench/cli/vpsbake --peer build/bench/tests/bench/openvdb_peer \
	  --mesh $(BUNNY) --scale 0.0775 --work build/bench
	build/bench/cli/vpsbake $(BUNNY) --scale 0.0775 --voxel 0.5mm --fields scaled,real -o build/bench/field.vps.hdf
	build/bench/tests/bench/field_error $(BUNNY) build/bench/field.vps.hdf --scale 0.0775
	build/bench/tests/bench/budget_overrun build/bench/field.vps.hdf 100
	build/bench/tests/bench/kernel_sweep $(BUNNY) --scale 0.0775 --work build/bench/query
	build/bench/tests/bench/query_bench $(BUNNY) --scale 0.0775 --work build/bench/query --json build/bench/query.json
	build/bench/tests/bench/motion_bench --json build/bench/motion.json
	build/bench/tests/bench/scene_bench $(BUNNY) --scale 0.0775 --work build/bench/query --json build/bench/scenes.json
	build/bench/tests/bench/growth_bench $(BUNNY) --scale 0.0775 --work build/bench/query/growth --json build/bench/growth.json
	build/bench/tests/bench/thin_faces sample_meshes/gear.obj sample_meshes/nut.obj sample_meshes/cube.obj sample_meshes/hole.obj sample_meshes/bolt.obj
	$(MAKE) bench-accuracy

# Measures the error of whole queries on eight pairs of bodies against an oracle, and that of convex hulls. The first run takes ten
# minutes more, for HACD.
bench-accuracy: PACKAGES += $(BENCH_PACKAGES)
bench-accuracy: deps
ifneq ($(wildcard ../shared/meshes),)
	cmake --preset bench
	cmake --build --preset bench -j $(JOBS) --target query_accuracy
	build/bench/tests/bench/query_accuracy $(ACCURACY_MESHES) --work build/bench/query
else
	@echo "no ../shared/meshes: the accuracy of queries is not measured"
endif

# Bakes a mesh of 1.7 million triangles at 1024 voxels, and a grid of 2048 voxels; prints time per stage and peak memory as Markdown tables.
bench-scale: all $(BUNNY)
	python3 -B tests/bench/bench_scale.py --vpsbake build/release/cli/vpsbake --mesh $(BUNNY) --scale 0.0775 --work build

# Repeats the paper's experiments (Sec. 4), also with Bullet's own algorithms; writes docs/internals/paper. The first run takes minutes more,
# for HACD.
paper: PACKAGES += $(PAPER_PACKAGES)
paper: deps $(BUNNY)
	cmake --preset bench
	cmake --build --preset bench -j $(JOBS) --target paper_runs
	mkdir -p docs/internals/paper
	$(PAPER_PYTHON) -B tests/paper/paper.py --runs build/bench/tests/paper/paper_runs --mesh $(BUNNY) --scale 0.0775 \
	  --work build/bench/query -o docs/internals/paper

# Checks and bakes every mesh of ../shared; writes docs/internals/corpus.md.
corpus: all
	python3 -B tests/bench/corpus.py --vpsbake build/release/cli/vpsbake --shared ../shared --work build -o docs/internals/corpus.md

# Runs libFuzzer on opening and querying assets, for FUZZ_SECONDS, and keeps its findings in build/fuzz. Before that, asks everything
# about damaged assets for as long, with the machine's widest vectors and without sanitizers; FUZZ_FIRST is the first mutant's number.
fuzz: PACKAGES += $(FUZZ_PACKAGES)
fuzz: deps
	cmake --preset dev
	cmake --build --preset dev -j $(JOBS) --target write_seeds fuzz_native
	build/dev/tests/fuzz/fuzz_native $(FUZZ_SECONDS) $(FUZZ_FIRST)
	cmake --preset fuzz
	cmake --build --preset fuzz -j $(JOBS)
	build/dev/tests/fuzz/write_seeds build/fuzz/seeds
	mkdir -p build/fuzz/corpus
	build/fuzz/tests/fuzz/fuzz_asset -max_total_time=$(FUZZ_SECONDS) -artifact_prefix=build/fuzz/ build/fuzz/corpus build/fuzz/seeds

# Searches the worst case of every promise, damages assets and meshes, kills bakes, fills disks, and validates a corpus; writes
# docs/internals/trust.md. Takes four times TRUST_SECONDS and ten minutes. Fails when something breaks, which it keeps in build/trust.
trust: PACKAGES += $(FUZZ_PACKAGES) $(TEST_PACKAGES)
trust: deps
	cmake --preset dev
	cmake --build --preset dev -j $(JOBS) --target vpsbake attack_promises fuzz_native write_seeds faults_test formats_test cli_test
	cmake --preset fuzz
	cmake --build --preset fuzz -j $(JOBS)
	mkdir -p build/trust
	python3 -B tests/trust/trust.py --build build/dev --fuzzer build/fuzz/tests/fuzz/fuzz_asset $(if $(wildcard ../shared/meshes),--shared ../shared) \
	  --seconds $(TRUST_SECONDS) --first $(TRUST_FIRST) --work build/trust -o docs/internals/trust.md

# Takes about 40 minutes on two cores from scratch; docs/internals/benchmarks/build.md has the times of each step.
test: test-dev test-tsan test-sanitize

# Only in `make test-all`: long tests of what others test too, on other meshes, pages or seeds; Slurm; the harness for pages; and the runtime
# installed alone, which the build for threads compiles without the baker too.
LONG := ^(Browser\.|Engines\.slurm|Extremes\.AHundredBoxesInARow|Install\.TheRuntimeAlone|StressCommand\.TheSameRunTwice|Seeds/Killed\..*/[123]$$
LONG := $(LONG)|Closed/RealMeshes\.Bake/(armadillo_52k|bunny_closed|scallop_120k|tires_x4)|All/GoldenBakes\..*/(bolt|nut)$$
LONG := $(LONG)|View\.(APageOfA[PV]|BodiesOfAnySize|BothRamps|ButtonsAndScale|LayersStored)
LONG := $(LONG)|Motion\.(ABodyThinner|ALongRecording|BodiesOnALongWay|OnAShortWay|ThePagePlays))

test-dev: PACKAGES += $(TEST_PACKAGES) $(PYTHON_PACKAGES) $(MUJOCO_PACKAGES)
test-dev: deps
	$(call say,1 of 3: building everything: about 10 minutes from scratch)
	cmake --preset dev
	cmake --build --preset dev -j $(JOBS)
	$(call say,1 of 3: running the tests: about 8 minutes)
	$(call run_tests,build/dev,-LE slow -E '$(LONG)')

# Suites that bake whole meshes or run minutes of physics run with sanitizers only in `make test-all`: the same code runs in others too.
LONG_SANITIZED := ^(Batch|BatchParts|ChangingMeshes|CliCache|Closed/.*|Extremes|LoadScene|Scene|Shared/.*|Slice|SliceOfLayers|StressCommand|Urdf|VirtualTool|WrenchOfPatches|lab_test|standing_test)\.|^(Cli\.FieldError|PolygonSoup\.Shared)

# Runs the tests again, built by clang with AddressSanitizer and UndefinedBehaviorSanitizer. Leaves out those in which sanitizers can
# find nothing new: pages in a browser, engines, installation, Bullet in double precision. Needs a processor with AVX2.
test-sanitize: PACKAGES += $(TEST_PACKAGES)
test-sanitize: deps
	$(call say,3 of 3: building with clang and sanitizers: about 12 minutes from scratch)
	cmake --preset sanitize
	cmake --build --preset sanitize -j $(JOBS)
	$(call say,3 of 3: running the tests with sanitizers: about 8 minutes)
	$(call run_tests,build/sanitize,-LE slow -E '$(LONG)|$(LONG_SANITIZED)')

# Runs queries, batches and Bullet's pairs on several threads under ThreadSanitizer, on an asset that the program of the dev build
# bakes, and the exact cuts of crossing shells. GCC 12's ThreadSanitizer fails where addresses are randomized in more than 28 bits, so setarch switches this off where it may.
test-tsan: deps
	$(call say,2 of 3: threads under ThreadSanitizer: about 2 minutes)
	cmake --preset dev
	cmake --build --preset dev -j $(JOBS) --target vpsbake
	cmake --preset tsan
	cmake --build --preset tsan -j $(JOBS)
	build/dev/cli/vpsbake sample_meshes/gear.obj --voxel 0.5mm -o build/tsan/gear.vps.hdf
	$(shell setarch -R true 2>/dev/null && echo setarch -R) build/tsan/tests/threads/threads_test build/tsan/gear.vps.hdf
	$(shell setarch -R true 2>/dev/null && echo setarch -R) build/tsan/tests/threads/exact_cuts_test

# Builds the runtime without the baker's libraries; Install.TheRuntimeAloneBuilds of `make test-all` tests the same.
test-runtime-only: deps
	cmake --preset runtime-only
	cmake --build --preset runtime-only -j $(JOBS)

# Installs, uses and removes the packages in a fresh minimal system; skipped without root.
test-deb: PACKAGES += $(SYSTEM_PACKAGES)
test-deb: deb
	sh tests/install/debian.sh build/packages || [ $$? = 77 ]

# Runs the steps of cli/package/Containerfile in fresh minimal systems, without a container engine; skipped without root. Takes as long as
# `make deb` from scratch and ten minutes.
test-container: PACKAGES += $(SYSTEM_PACKAGES)
test-container: deps
	sh tests/install/container.sh || [ $$? = 77 ]

# Runs clang-tidy on the sources of the libraries and the program. Any warning is a failure.
tidy: PACKAGES += $(TIDY_PACKAGES)
tidy: deps
	cmake --preset edit
	cmake --build --preset edit --target vps_cache_program
	sh tests/style/tidy.sh build/edit $(JOBS)

test-all: PACKAGES += $(TEST_PACKAGES) $(PYTHON_PACKAGES) $(MUJOCO_PACKAGES) $(DEB_PACKAGES) $(SYSTEM_PACKAGES) $(TIDY_PACKAGES)
test-all: test deb tidy
	$(call run_tests,build/dev,-L slow)
	$(call run_tests,build/dev,-LE slow -R '$(LONG)')
	$(call run_tests,build/sanitize,-LE slow -R '$(LONG)|$(LONG_SANITIZED)')

clean:
	rm -rf build

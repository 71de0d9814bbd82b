# SPDX-License-Identifier: MIT
# The front door: each target does everything it needs, set-up included. The work is in CMakeLists.txt and CMakePresets.json.
#
#   JOBS=n      parallel jobs (default: all processors)
#   PREFIX=dir  where `make install` puts the tree (default /usr/local)
#   DURATION=t  of `make soak`: 30s, 10m, 2h; of `make fuzz`: seconds
#   FUZZERS=... only these: client, server, tools, recording, frames, server_router, client_router
#   TESTS=regex only the tests whose name matches
#   COPIES=n    of `make test-repeated`: runs of all tests beside each other (default 6)
#   ROUNDS=n    of `make test-repeated`: how many times (default 20)
#   BENCH=...   of `make bench`: local (default), remote or hardware

JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
CTEST_FLAGS ?= --parallel $(shell expr 2 \* $(JOBS))
PRESETS := release debug edit asan tsan
TESTED := debug edit asan tsan
SOURCES := git -c safe.directory='*' ls-files -z --cached --others --exclude-standard '*.h' '*.cpp'

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-repeated test-big-endian test-tpci200 soak fuzz bench install format format-check tidy clean $(PRESETS) $(TESTED:%=test-%)

help: ## this list
	@sed -nE 's/^([a-z][a-z0-9-]*):[^#]*## (.*)/  make \1\t\2/p' Makefile | expand -t 24

setup: ## install what is missing from Debian packages (every other target calls it)
	@scripts/setup

demo: release ## a voltmeter, its server, clients, and what a crash does; then modules that are wired to each other
	./examples/demo/run build/release
	./examples/demo/hardware build/release

test: test-debug ## build with debug information and run every test

test-repeated: debug ## every test, COPIES beside each other, ROUNDS times: none may fail, nothing may be left (COPIES=6 ROUNDS=20)
	scripts/repeat-tests build/debug --copies $(or $(COPIES),6) --rounds $(or $(ROUNDS),20) $(if $(TESTS),--tests '$(TESTS)')

test-big-endian: debug ## messages between this host and one of the other byte order, which is emulated
	@scripts/setup big-endian
	@scripts/big-endian-sysroot
	@cmake --preset big-endian --log-level=NOTICE
	cmake --build --preset big-endian --parallel $(JOBS)
	ctest --preset big-endian $(CTEST_FLAGS)
	MPF_TEST_BIG_ENDIAN="$(CURDIR)/build/big-endian" ctest --preset debug $(CTEST_FLAGS) --label-regex '^byte_order_test$$'

test-tpci200: debug ## the PCI carrier and serial servers on octal UARTs behind it, in a machine that is emulated
	@scripts/setup tpci200
	@scripts/tpci200-machine make build/debug
	MPF_TEST_TPCI200="$(CURDIR)/build/debug" ctest --preset debug $(CTEST_FLAGS) --label-regex '^tpci200_test$$'

soak: debug ## hours of traffic with clients that are killed; memory and descriptors must stay flat (DURATION=2h)
	build/debug/bin/mpf_test_soak $(or $(DURATION),2h)

fuzz: ## contents of shared memory that harm who reads them, looked for with coverage (DURATION=60 FUZZERS=tools)
	@scripts/setup fuzz
	@cmake --preset fuzz --log-level=NOTICE
	cmake --build --preset fuzz --parallel $(JOBS)
	scripts/fuzz build/fuzz $(or $(DURATION),60) $(FUZZERS)

bench: release ## measure this host (BENCH=local, remote or hardware); the table also goes to build/release/bench/
	@mkdir -p build/release/bench
	bash -o pipefail -c 'build/release/bin/mpf bench $(or $(BENCH),local) | tee build/release/bench/$(or $(BENCH),local).txt'

install: release ## install headers, libraries, programs and man pages under PREFIX
	cmake --install build/release --prefix "$(PREFIX)"

format: setup ## format all sources
	$(SOURCES) | xargs -0 --no-run-if-empty clang-format-19 -i

format-check: setup ## name the sources that `make format` would change
	$(SOURCES) | xargs -0 --no-run-if-empty clang-format-19 --dry-run -Werror

tidy: ## clang-tidy over the targets that changed since they were last clean (FOLDERS="shm router": only there)
	@scripts/setup fuzz
	@cmake --preset tidy --log-level=NOTICE
	@cmake --build --preset tidy --parallel $(JOBS)
	scripts/tidy build/tidy $(JOBS) $(FOLDERS)

clean: ## remove build/
	$(RM) -r build

# make release, debug, edit, asan, tsan: build with that preset. make test-asan: and run its tests.
$(PRESETS): setup
	@cmake --preset $@ --log-level=NOTICE
	cmake --build --preset $@ --parallel $(JOBS)

$(TESTED:%=test-%): test-%: %
	ctest --preset $* $(CTEST_FLAGS) $(if $(TESTS),--tests-regex '$(TESTS)')

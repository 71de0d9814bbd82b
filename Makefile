# SPDX-License-Identifier: MIT
# The front door: each target does everything it needs, set-up included. The work is in CMakeLists.txt and CMakePresets.json.
#
#   JOBS=n      parallel jobs (default: all processors)
#   PREFIX=dir  where `make install` puts the tree (default /usr/local)
#   DURATION=t  of `make soak`: 30s, 10m, 2h; of `make fuzz`: seconds
#   FUZZERS=... only these: client, server, tools, recording
#   TESTS=regex only the tests whose name matches

JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
CTEST_FLAGS ?= --parallel $(JOBS)
PRESETS := release debug edit asan tsan
TESTED := debug edit asan tsan
SOURCES := git -c safe.directory='*' ls-files -z --cached --others --exclude-standard '*.h' '*.cpp'

.DEFAULT_GOAL := help
.PHONY: help setup demo test soak fuzz bench install format format-check tidy clean $(PRESETS) $(TESTED:%=test-%)

help: ## this list
	@sed -nE 's/^([a-z][a-z-]*):[^#]*## (.*)/  make \1\t\2/p' Makefile | expand -t 22

setup: ## install what is missing from Debian packages (every other target calls it)
	@scripts/setup

demo: release ## a client, shared memory, a serial server on a terminal line, and what a crash does
	./demo/run build/release

test: test-debug ## build with debug information and run every test

soak: debug ## hours of traffic with clients that are killed; memory and descriptors must stay flat (DURATION=2h)
	build/debug/bin/mpf_test_soak $(or $(DURATION),2h)

fuzz: ## contents of shared memory that harm who reads them, looked for with coverage (DURATION=60 FUZZERS=tools)
	@scripts/setup fuzz
	@cmake --preset fuzz --log-level=NOTICE
	cmake --build --preset fuzz --parallel $(JOBS)
	scripts/fuzz build/fuzz $(or $(DURATION),60) $(FUZZERS)

bench: release ## how fast, beside the physical floors and other message systems
	build/release/bin/mpf bench local

install: release ## install headers, libraries, programs and man pages under PREFIX
	cmake --install build/release --prefix "$(PREFIX)"

format: setup ## format all sources
	$(SOURCES) | xargs -0 --no-run-if-empty clang-format-19 -i

format-check: setup ## name the sources that `make format` would change
	$(SOURCES) | xargs -0 --no-run-if-empty clang-format-19 --dry-run -Werror

tidy: setup ## clang-tidy over the targets that changed since they were last clean
	@cmake --preset tidy --log-level=NOTICE
	@cmake --build --preset tidy --parallel $(JOBS)
	scripts/tidy build/tidy $(JOBS)

clean: ## remove build/
	$(RM) -r build

# make release, debug, edit, asan, tsan: build with that preset. make test-asan: and run its tests.
$(PRESETS): setup
	@cmake --preset $@ --log-level=NOTICE
	cmake --build --preset $@ --parallel $(JOBS)

$(TESTED:%=test-%): test-%: %
	ctest --preset $* $(CTEST_FLAGS) $(if $(TESTS),--tests-regex '$(TESTS)')

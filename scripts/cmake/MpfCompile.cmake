# Compiler and linker settings of all targets.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# All programs are in one folder, where the demo, the tests and `make bench` find them.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")

# Fields of messages are stored one by one and loaded soon afterwards. A vector load of several
# fields would have to wait until their stores have reached the cache.
add_compile_options(-fno-tree-slp-vectorize)
# Code for shared libraries, too, calls the functions of its own source file directly.
add_compile_options(-fno-semantic-interposition)
# Public headers are included as users do: <mpf/message.h>. All others are named from the root:
# "shm/link.h".
add_compile_options("SHELL:-iquote ${CMAKE_SOURCE_DIR}"
  "SHELL:-iquote ${CMAKE_BINARY_DIR}/generated")

# The compiler collects its garbage later: 5 to 30 % less time for sources that are compiled
# together, and up to 220 MB more memory for each process
# (docs/decisions/0047-cli11-compiled-once.md).
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  add_compile_options("SHELL:--param ggc-min-heapsize=600000")
endif()

add_library(mpf_warnings INTERFACE)
target_compile_options(mpf_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  -Wnon-virtual-dtor -Wold-style-cast -Werror)

# With optimisation, g++ 12 reports overlapping copies in "a" + std::string(...) (GCC bug 105651).
target_compile_options(mpf_warnings INTERFACE $<$<CONFIG:Release>:-Wno-restrict>)

if(CMAKE_CXX_COMPILER_ID STREQUAL Clang) # for fuzzing
  add_compile_options("SHELL:-include ${CMAKE_SOURCE_DIR}/scripts/kj_for_clang.h")
  # In libstdc++ 12 itself, in macros of KJ, and with names of other sources in the same unit.
  target_compile_options(mpf_warnings INTERFACE -Wno-deprecated-declarations
    -Wno-gnu-statement-expression-from-macro-expansion -Wno-shadow)
endif()

set(MPF_SANITIZE "" CACHE STRING
  "Sanitizers, in the notation of -fsanitize=: address,undefined or thread")
if(MPF_SANITIZE)
  # -Og -g1 compiles in half the time of -O1 -g, and reports still contain line numbers. In the code
  # that a sanitizer adds, g++ 12 warns of variables that may be uninitialised.
  add_compile_options(-fsanitize=${MPF_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer
    -Og -g1 $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  # These checks cost a fifth of the compile time. AddressSanitizer detects the same errors, or the
  # error is harmless on this processor.
  if(MPF_SANITIZE MATCHES undefined)
    add_compile_options(-fno-sanitize=null,alignment,vptr,object-size)
  endif()
  add_link_options(-fsanitize=${MPF_SANITIZE})
endif()
# g++ warns that ThreadSanitizer does not model std::atomic_thread_fence; the tests show whether
# this causes false reports.
if(MPF_SANITIZE STREQUAL thread)
  target_compile_options(mpf_warnings INTERFACE -Wno-tsan)
endif()

# The tests are about a hundred programs. GNU ld needs a second for each, mold a fraction of that.
# Programs that are installed use the default linker.
find_program(MPF_MOLD mold)
set(fastLinker "")
if(MPF_MOLD AND CMAKE_CXX_COMPILER_ID STREQUAL GNU AND NOT CMAKE_CROSSCOMPILING)
  set(fastLinker -fuse-ld=mold)
endif()
if(CMAKE_BUILD_TYPE STREQUAL Debug)
  add_link_options(${fastLinker})
endif()

find_program(MPF_CCACHE ccache)
if(MPF_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${MPF_CCACHE}")
endif()

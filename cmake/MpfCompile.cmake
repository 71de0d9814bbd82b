# How every target is compiled.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# Sources say #include <mpf/shm/window.h>, in this tree and in programs that use the installed one.
set(MPF_INCLUDE_ROOT "${CMAKE_BINARY_DIR}/include")
file(MAKE_DIRECTORY "${MPF_INCLUDE_ROOT}/mpf")
foreach(folder base schema shm client server drivers tools tests benchmarks)
  file(CREATE_LINK "${CMAKE_SOURCE_DIR}/${folder}" "${MPF_INCLUDE_ROOT}/mpf/${folder}" SYMBOLIC)
endforeach()

add_library(mpf_warnings INTERFACE)
target_compile_options(mpf_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wnon-virtual-dtor -Wold-style-cast -Werror)

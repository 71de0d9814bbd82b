# mpf_cli11: CLI11, compiled once. Its functions are inline, so each source that uses a command line
# would compile them again, which takes half to three quarters of the time for a small source. g++
# leaves that to one source if each header begins with `#pragma interface`: the target has such
# copies (docs/decisions/0047-cli11-compiled-once.md).
get_target_property(include CLI11::CLI11 INTERFACE_INCLUDE_DIRECTORIES)
# Newer versions of CLI11 consist of two folders.
if(NOT CMAKE_CXX_COMPILER_ID STREQUAL GNU OR NOT EXISTS "${include}/CLI/CLI.hpp" OR
    EXISTS "${include}/CLI/impl")
  add_library(mpf_cli11 INTERFACE)
  target_link_libraries(mpf_cli11 INTERFACE CLI11::CLI11)
  return()
endif()

file(GLOB headers "${include}/CLI/*.hpp")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${headers})
set(copies "${CMAKE_BINARY_DIR}/generated/cli11")
set(source "#include <CLI/CLI.hpp>\n")
foreach(header IN LISTS headers)
  cmake_path(GET header FILENAME name)
  file(READ "${header}" text)
  file(CONFIGURE OUTPUT "${copies}/CLI/${name}" CONTENT "#pragma interface\n${text}" @ONLY)
  string(PREPEND source "#pragma implementation \"${name}\"\n")
endforeach()
file(CONFIGURE OUTPUT "${copies}/cli11.cpp" CONTENT "${source}" @ONLY)

add_library(mpf_cli11 STATIC "${copies}/cli11.cpp")
target_include_directories(mpf_cli11 SYSTEM PUBLIC "${copies}")

# Finds EPICS Base 7: the installation EPICS_BASE (variable or environment) with EPICS_HOST_ARCH,
# else that of the system, else the one that scripts/setup downloaded into build/epics-base.
# Defines EPICS_DBD_FILES, EPICS_LIBRARY_DIR and the targets EPICS::Com, EPICS::ca, EPICS::dbCore
# and EPICS::dbRecStd. EPICS::pvxsIoc, for pvAccess, exists only if PVXS (variable or environment)
# or the download has it; its dbd file is then one of EPICS_DBD_FILES, and EPICS_PVXS_LIBRARY_DIR
# is set.
include(FindPackageHandleStandardArgs)

set(candidates "${EPICS_BASE}" "$ENV{EPICS_BASE}" /usr/lib/epics
  "${CMAKE_SOURCE_DIR}/build/epics-base/epicscorelibs")
if(MPF_SANITIZE STREQUAL thread) # only a Base that is compiled with it
  set(candidates "${CMAKE_SOURCE_DIR}/build/epics-base-tsan/epicscorelibs")
endif()
set(architecture "$ENV{EPICS_HOST_ARCH}")
if(EPICS_HOST_ARCH)
  set(architecture "${EPICS_HOST_ARCH}")
elseif(NOT architecture)
  set(architecture "linux-${CMAKE_SYSTEM_PROCESSOR}")
endif()
foreach(named "${EPICS_BASE}" "$ENV{EPICS_BASE}")
  if(named AND NOT EXISTS "${named}/include/dbCommon.h")
    message(FATAL_ERROR "EPICS_BASE is ${named}, which is not an installation of EPICS Base 7: "
      "it has no include/dbCommon.h. Correct it, or unset it to use the downloaded one")
  endif()
endforeach()
foreach(candidate IN LISTS candidates)
  if(candidate AND EXISTS "${candidate}/include/dbCommon.h" AND EXISTS "${candidate}/dbd/base.dbd")
    set(EPICS_ROOT "${candidate}")
    break()
  endif()
endforeach()

if(EPICS_ROOT)
  file(GLOB EPICS_DBD_FILES "${EPICS_ROOT}/dbd/*.dbd")
  set(EPICS_LIBRARY_DIR "${EPICS_ROOT}/lib")
  if(EXISTS "${EPICS_ROOT}/lib/${architecture}")
    set(EPICS_LIBRARY_DIR "${EPICS_ROOT}/lib/${architecture}")
  endif()
  set(includes "${EPICS_ROOT}/include")
  foreach(folder os/Linux compiler/gcc)
    if(EXISTS "${EPICS_ROOT}/include/${folder}")
      list(APPEND includes "${EPICS_ROOT}/include/${folder}")
    endif()
  endforeach()
  file(STRINGS "${EPICS_ROOT}/include/epicsVersion.h" versionLines
    REGEX "define EPICS_(VERSION|REVISION|MODIFICATION) ")
  string(REGEX MATCHALL "[0-9]+" versionNumbers "${versionLines}")
  list(JOIN versionNumbers "." EPICS_VERSION)
endif()

find_package_handle_standard_args(EPICS REQUIRED_VARS EPICS_ROOT VERSION_VAR EPICS_VERSION)

# Adds the target EPICS::<library> for a library in `folder`.
function(add_epics_library library folder)
  # The unversioned library of the wheel is a copy, not a link: two of them would be loaded.
  file(GLOB versioned "${folder}/lib${library}.so.*")
  list(APPEND versioned "${folder}/lib${library}.so")
  list(GET versioned 0 location)
  add_library(EPICS::${library} SHARED IMPORTED)
  set_target_properties(EPICS::${library} PROPERTIES IMPORTED_LOCATION "${location}")
endfunction()

foreach(candidate "${PVXS}" "$ENV{PVXS}" "${EPICS_ROOT}/../pvxslibs" "${EPICS_ROOT}")
  if(EPICS_FOUND AND candidate AND EXISTS "${candidate}/dbd/pvxsIoc.dbd")
    list(APPEND EPICS_DBD_FILES "${candidate}/dbd/pvxsIoc.dbd")
    list(REMOVE_DUPLICATES EPICS_DBD_FILES)
    set(EPICS_PVXS_LIBRARY_DIR "${candidate}/lib")
    if(EXISTS "${candidate}/lib/${architecture}")
      set(EPICS_PVXS_LIBRARY_DIR "${candidate}/lib/${architecture}")
    endif()
    break()
  endif()
endforeach()

if(EPICS_FOUND AND NOT TARGET EPICS::Com)
  foreach(library Com ca dbCore dbRecStd)
    add_epics_library(${library} "${EPICS_LIBRARY_DIR}")
  endforeach()
  if(EPICS_PVXS_LIBRARY_DIR)
    add_epics_library(pvxsIoc "${EPICS_PVXS_LIBRARY_DIR}")
    target_link_libraries(EPICS::pvxsIoc INTERFACE EPICS::dbCore)
  endif()
  target_include_directories(EPICS::Com INTERFACE ${includes})
  target_compile_definitions(EPICS::Com INTERFACE linux UNIX _GNU_SOURCE _DEFAULT_SOURCE
    USE_TYPED_RSET USE_TYPED_DSET USE_TYPED_DRVET)
  target_link_libraries(EPICS::dbCore INTERFACE EPICS::Com EPICS::ca)
  target_link_libraries(EPICS::dbRecStd INTERFACE EPICS::dbCore)
  target_link_libraries(EPICS::ca INTERFACE EPICS::Com)
endif()

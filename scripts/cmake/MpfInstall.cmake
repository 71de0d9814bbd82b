# The installed tree: one library, its headers, mpf::mpf, mpf::classic, pkg-config mpf, the programs
# and their man pages, the documents and the examples.
include(CMakePackageConfigHelpers)

# Appends to `out` the targets that the CMakeLists of `folder` and below define, if their type is
# `type`, a regular expression.
function(mpf_find_targets out folder type)
  get_property(targets DIRECTORY "${folder}" PROPERTY BUILDSYSTEM_TARGETS)
  get_property(subfolders DIRECTORY "${folder}" PROPERTY SUBDIRECTORIES)
  foreach(target IN LISTS targets)
    get_target_property(targetType ${target} TYPE)
    if(targetType MATCHES "^(${type})$")
      list(APPEND ${out} ${target})
    endif()
  endforeach()
  foreach(subfolder IN LISTS subfolders)
    mpf_find_targets(${out} "${subfolder}" ${type})
  endforeach()
  set(${out} "${${out}}" PARENT_SCOPE)
endfunction()

# The public libraries, which other repositories link as one archive libmpf.a: one name, and no link
# order to get right. All libraries of drivers/ are public.
set(publicLibraries mpf_base mpf_schema mpf_shm mpf_message_link mpf_client mpf_server
  mpf_classic_messages mpf_classic)
if(drivers IN_LIST folders AND EXISTS "${CMAKE_SOURCE_DIR}/drivers/CMakeLists.txt")
  mpf_find_targets(publicLibraries "${CMAKE_SOURCE_DIR}/drivers" STATIC_LIBRARY)
endif()

# External libraries that the public libraries may link, and how a consumer finds them: target,
# find_package() arguments, pkg-config name ("-": not needed).
set(outsideTargets Threads::Threads Boost::headers CapnProto::capnp CapnProto::kj fmt::fmt
  spdlog::spdlog)
set(outsidePackages Threads "Boost 1.74" CapnProto CapnProto fmt spdlog)
set(outsideModules - - capnp kj fmt spdlog)

# ---- the library

set(objects "")
set(links "")
foreach(library IN LISTS publicLibraries)
  if(NOT TARGET ${library})
    continue()
  endif()
  get_target_property(type ${library} TYPE)
  set(property INTERFACE_LINK_LIBRARIES)
  if(type STREQUAL STATIC_LIBRARY)
    list(APPEND objects $<TARGET_OBJECTS:${library}>)
    set(property LINK_LIBRARIES)
  endif()
  get_target_property(libraryLinks ${library} ${property})
  if(libraryLinks)
    list(APPEND links ${libraryLinks})
  endif()
endforeach()
list(REMOVE_DUPLICATES links)
list(FILTER links EXCLUDE REGEX "^mpf_")

set(requiredModules "")
set(findDependencies "")
foreach(link IN LISTS links)
  list(FIND outsideTargets "${link}" at)
  if(at LESS 0)
    message(FATAL_ERROR "A public library links ${link}, which is not in the table in "
      "scripts/cmake/MpfInstall.cmake: add it there")
  endif()
  list(GET outsidePackages ${at} package)
  list(GET outsideModules ${at} module)
  string(APPEND findDependencies "find_dependency(${package})\n")
  if(NOT module STREQUAL "-")
    string(APPEND requiredModules " ${module}")
  endif()
endforeach()

set(pkgConfigLibrary "")
if(objects)
  set(pkgConfigLibrary "-lmpf")
  add_library(mpf_all STATIC ${objects})
  set_target_properties(mpf_all PROPERTIES LINKER_LANGUAGE CXX)
else()
  add_library(mpf_all INTERFACE)
endif()
set_target_properties(mpf_all PROPERTIES EXPORT_NAME mpf OUTPUT_NAME mpf)
target_link_libraries(mpf_all INTERFACE ${links})
target_compile_features(mpf_all INTERFACE cxx_std_20)
target_include_directories(mpf_all INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)

# ---- headers and packages

install(DIRECTORY "${CMAKE_SOURCE_DIR}/include/mpf" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  PATTERN epics EXCLUDE) # epics/ installs its own
install(FILES schema/message.capnp schema/router.capnp schema/recording.capnp
  DESTINATION ${CMAKE_INSTALL_DATADIR}/mpf) # for other implementations

set(packageFolder ${CMAKE_INSTALL_LIBDIR}/cmake/mpf)
install(TARGETS mpf_all mpf_classic_names EXPORT mpfTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT mpfTargets NAMESPACE mpf:: DESTINATION ${packageFolder})
configure_package_config_file(scripts/cmake/mpfConfig.cmake.in mpfConfig.cmake
  INSTALL_DESTINATION ${packageFolder})
write_basic_package_version_file(mpfConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/mpfConfig.cmake" "${CMAKE_BINARY_DIR}/mpfConfigVersion.cmake"
  DESTINATION ${packageFolder})

file(RELATIVE_PATH upToPrefix "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
string(REGEX REPLACE "/$" "" upToPrefix "${upToPrefix}")
configure_file(scripts/cmake/mpf.pc.in mpf.pc @ONLY)
install(FILES "${CMAKE_BINARY_DIR}/mpf.pc" DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# ---- documents and examples, in the folders in which their links find each other

install(FILES LICENSE README.md CHANGELOG.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES benchmarks/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/benchmarks)
install(DIRECTORY docs examples DESTINATION ${CMAKE_INSTALL_DOCDIR} USE_SOURCE_PERMISSIONS
  PATTERN __pycache__ EXCLUDE)
# Their links to include/mpf.
file(RELATIVE_PATH installedHeaders "/${CMAKE_INSTALL_DOCDIR}/include"
  "/${CMAKE_INSTALL_INCLUDEDIR}/mpf")
file(MAKE_DIRECTORY "${CMAKE_BINARY_DIR}/doc/include")
file(CREATE_LINK "${installedHeaders}" "${CMAKE_BINARY_DIR}/doc/include/mpf" SYMBOLIC)
install(DIRECTORY "${CMAKE_BINARY_DIR}/doc/include" DESTINATION ${CMAKE_INSTALL_DOCDIR})
# The tables of `make bench`.
install(DIRECTORY "${CMAKE_BINARY_DIR}/bench" DESTINATION ${CMAKE_INSTALL_DOCDIR} OPTIONAL
  FILES_MATCHING PATTERN "*.txt")

# ---- programs and man pages: every executable of these folders

set(programs "")
foreach(folder client server router epics crate tools benchmarks)
  if(folder IN_LIST folders AND EXISTS "${CMAKE_SOURCE_DIR}/${folder}/CMakeLists.txt")
    mpf_find_targets(programs "${CMAKE_SOURCE_DIR}/${folder}" EXECUTABLE)
  endif()
endforeach()
if(programs)
  install(TARGETS ${programs} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

find_program(MPF_HELP2MAN help2man)
if(MPF_BUILD_MAN_PAGES AND MPF_HELP2MAN AND NOT CMAKE_CROSSCOMPILING)
  set(pages "")
  set(makeManPage "${CMAKE_SOURCE_DIR}/scripts/cmake/make-man-page")
  foreach(program IN LISTS programs)
    get_target_property(name ${program} OUTPUT_NAME)
    if(NOT name)
      set(name ${program})
    endif()
    set(page "${CMAKE_BINARY_DIR}/man/${name}.1")
    add_custom_command(OUTPUT "${page}" DEPENDS ${program} "${makeManPage}"
      COMMAND "${makeManPage}" $<TARGET_FILE:${program}> "${page}" "MPF ${PROJECT_VERSION}"
      COMMENT "Man page of ${program}" VERBATIM)
    list(APPEND pages "${page}")
    # The pages of its subcommands.
    install(DIRECTORY "${CMAKE_BINARY_DIR}/man/${name}.d/"
      DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
  endforeach()
  add_custom_target(mpf_man_pages ALL DEPENDS ${pages})
  if(pages)
    install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
  endif()
endif()

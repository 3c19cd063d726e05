# SPDX-License-Identifier: Apache-2.0
# Debian packages (docs/install.md): `tools/package` makes them with CPack from the preset `release`, configured with the
# prefix /usr. What each needs of others, dpkg-shlibdeps finds in its programs.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME toftwin)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_VENDOR "toftwin")
set(CPACK_PACKAGE_CONTACT "toftwin maintainers <maintainers@toftwin.example>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_COMPONENTS_ALL "")

# What Debian wants beside every package; the day is that of the build, or SOURCE_DATE_EPOCH.
set(package_version ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})
set(package_folder ${PROJECT_BINARY_DIR}/debian)
set(debian ${PROJECT_SOURCE_DIR}/tools/debian)
string(TIMESTAMP PACKAGE_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file(${debian}/changelog.in ${package_folder}/changelog.Debian @ONLY)
configure_file(${PROJECT_SOURCE_DIR}/CHANGELOG.md ${package_folder}/changelog COPYONLY)
foreach(file changelog.Debian changelog)
  execute_process(COMMAND gzip -9nf ${package_folder}/${file} COMMAND_ERROR_IS_FATAL ANY)
endforeach()

# Paragraphs (empty lines between them) as lines of at most 76 characters.
function(toftwin_wrapped text result)
  string(REPLACE "\n\n" ";" paragraphs "${text}")
  set(lines "")
  foreach(paragraph IN LISTS paragraphs)
    string(REPLACE " " ";" words "${paragraph}")
    set(line "")
    foreach(word IN LISTS words)
      string(LENGTH "${line} ${word}" length)
      if(length GREATER 76)
        string(APPEND lines "${line}\n")
        set(line "${word}")
      else()
        string(STRIP "${line} ${word}" line)
      endif()
    endforeach()
    string(APPEND lines "${line}\n\n")
  endforeach()
  string(STRIP "${lines}" lines)
  set(${result} "${lines}" PARENT_SCOPE)
endfunction()

# toftwin_package(<component> NAME <package> SYNOPSIS <line> TEXT <paragraph> [SECTION …] [ARCHITECTURE all]
#                 [DEPENDS …] [RECOMMENDS …] [CONTROL <file>…])
macro(toftwin_package component)
  cmake_parse_arguments(arg "" "NAME;SYNOPSIS;TEXT;SECTION;ARCHITECTURE" "DEPENDS;RECOMMENDS;CONTROL" ${ARGN})
  string(TOUPPER ${component} upper)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${arg_NAME})
  toftwin_wrapped("${arg_TEXT}" wrapped)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${arg_SYNOPSIS}\n${wrapped}")
  foreach(field SECTION ARCHITECTURE)
    if(arg_${field})
      set(CPACK_DEBIAN_${upper}_PACKAGE_${field} ${arg_${field}})
    endif()
  endforeach()
  foreach(field DEPENDS RECOMMENDS)
    list(JOIN arg_${field} ", " packages)
    set(CPACK_DEBIAN_${upper}_PACKAGE_${field} "${packages}")
  endforeach()
  if(arg_ARCHITECTURE STREQUAL "all")
    set(CPACK_DEBIAN_${upper}_PACKAGE_SHLIBDEPS OFF)
  endif()
  set(CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA "${arg_CONTROL}")
  install(FILES ${debian}/copyright ${package_folder}/changelog.Debian.gz ${package_folder}/changelog.gz
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${arg_NAME} COMPONENT ${component} EXCLUDE_FROM_ALL)
  if(EXISTS ${debian}/${component}.lintian-overrides)
    install(FILES ${debian}/${component}.lintian-overrides DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides
            RENAME ${arg_NAME} COMPONENT ${component} EXCLUDE_FROM_ALL)
  endif()
endmacro()

set(of_one "toftwin lets programs use real and simulated time-of-flight cameras through one protocol, and finds out \
in what a simulated one differs from the real one.")
set(common "toftwin-common (= ${package_version})")
set(control ${PROJECT_SOURCE_DIR}/systemd/debian)
set(library libtoftwin${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
configure_file(${debian}/library/shlibs.in ${package_folder}/shlibs @ONLY)

toftwin_package(toftwind NAME toftwind SECTION science
  SYNOPSIS "daemon that serves time-of-flight cameras, real and simulated"
  TEXT "${of_one}\n\nThis package has the daemon, its systemd unit, and udev rules for depth cameras on USB. It is not started by \
itself: systemctl enable --now toftwind."
  DEPENDS ${common} "systemd | systemd-standalone-sysusers | systemd-sysusers" RECOMMENDS toftwin-meshes
  CONTROL ${control}/conffiles ${control}/postinst ${control}/prerm ${control}/postrm)
toftwin_package(toftwin NAME toftwin
  SYNOPSIS "watches, records, renders, calibrates and compares depth cameras"
  TEXT "${of_one}\n\nThis package has the command line." DEPENDS ${common} RECOMMENDS toftwin-meshes)
toftwin_package(common NAME toftwin-common ARCHITECTURE all
  SYNOPSIS "cameras and scenes of toftwin" TEXT "${of_one}\n\nThis package has the files of cameras and scenes that come with it.")
toftwin_package(meshes NAME toftwin-meshes
  SYNOPSIS "reader of further mesh formats for toftwin"
  TEXT "${of_one}\n\nThis package has the program that converts meshes of formats which toftwin does not read itself, such as Collada.")
toftwin_package(client NAME ${library} SECTION libs
  SYNOPSIS "client library of toftwin"
  TEXT "${of_one}\n\nThis package has the shared library of programs that are its clients."
  CONTROL ${package_folder}/shlibs ${debian}/library/triggers)
toftwin_package(development NAME libtoftwin-dev SECTION libdevel
  SYNOPSIS "client library of toftwin, to build programs with"
  TEXT "${of_one}\n\nThis package has headers, libraries to link, and the package for CMake."
  DEPENDS "${library} (= ${package_version})" libssl-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
if(TOFTWIN_HAS_OPENNI2)
  toftwin_package(openni2 NAME toftwin-openni2 SECTION libs
    SYNOPSIS "plug-in that shows the cameras of toftwin to programs that use OpenNI2"
    TEXT "${of_one}\n\nThis package has a driver that OpenNI2 loads: the sources of a daemon are devices there.")
endif()
if(TOFTWIN_HAS_PYTHON)
  toftwin_package(python NAME python3-toftwin SECTION python
    SYNOPSIS "time-of-flight cameras, real and simulated, as NumPy arrays"
    TEXT "${of_one}\n\nThis package has a module for Python 3: a client, recordings, the simulator, discovery and correction."
    DEPENDS ${common} "python3 (>= ${TOFTWIN_PYTHON_VERSION})" "python3 (<< ${TOFTWIN_PYTHON_VERSION}.99)" python3-numpy
    RECOMMENDS toftwin-meshes CONTROL ${debian}/python/postinst ${debian}/python/prerm)
endif()

# What of others is in the programs; tools/package has it made before it packs.
install(FILES ${PROJECT_BINARY_DIR}/sbom/toftwin.spdx.json ${PROJECT_BINARY_DIR}/sbom/THIRD-PARTY-NOTICES
        DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/toftwin COMPONENT toftwin EXCLUDE_FROM_ALL OPTIONAL)
include(CPack)

# SPDX-License-Identifier: Apache-2.0
# Libraries in layers. `toftwin_library` makes configuring fail when a library links one that is not
# below it, or includes a header of a library that it does not link.

# toftwin_library(<name> LAYER <n> FOLDER <folder>
#                 [SOURCES <file>…] [LINKS <toftwin name>…] [LIBRARIES <other target>…]
#                 [PUBLIC_HEADERS <include folder>])
# Sources are relative to FOLDER, which is relative to the project's root. Without sources the
# library is header-only. The target is toftwin_<name>, alias toftwin::<name>.
function(toftwin_library name)
  cmake_parse_arguments(arg "" "LAYER;FOLDER;PUBLIC_HEADERS" "SOURCES;LINKS;LIBRARIES" ${ARGN})
  set(target toftwin_${name})
  set(root ${PROJECT_SOURCE_DIR})
  set(reachable ${arg_FOLDER})
  foreach(link IN LISTS arg_LINKS)
    get_property(link_layer GLOBAL PROPERTY toftwin_layer_${link})
    if("${link_layer}" STREQUAL "")
      message(FATAL_ERROR "toftwin::${name} links toftwin::${link}, which no lower layer defines. "
                          "A library links only libraries of lower layers (docs/architecture.md).")
    endif()
    if(NOT link_layer LESS arg_LAYER)
      message(FATAL_ERROR "toftwin::${name} (layer ${arg_LAYER}) links toftwin::${link} (layer "
                          "${link_layer}). A library links only lower layers (docs/architecture.md).")
    endif()
    get_property(link_reachable GLOBAL PROPERTY toftwin_reachable_${link})
    list(APPEND reachable ${link_reachable})
  endforeach()
  list(REMOVE_DUPLICATES reachable)
  _toftwin_check_libraries(${name} "${arg_LIBRARIES}")
  set_property(GLOBAL PROPERTY toftwin_layer_${name} ${arg_LAYER})
  set_property(GLOBAL PROPERTY toftwin_reachable_${name} ${reachable})
  _toftwin_check_includes(${name} ${arg_FOLDER} "${reachable}")

  list(TRANSFORM arg_LINKS PREPEND toftwin::)
  if(arg_SOURCES)
    list(TRANSFORM arg_SOURCES PREPEND ${root}/${arg_FOLDER}/)
    add_library(${target} ${arg_SOURCES})
    target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${root}>)
    target_link_libraries(${target} PUBLIC ${arg_LINKS} PRIVATE ${arg_LIBRARIES}
                          $<BUILD_INTERFACE:toftwin_options>)
    if(TOFTWIN_QUICK_BUILD AND NOT arg_FOLDER MATCHES "^(sim|tests)/|^calib/loop$")
      # Less optimised, GCC 12 takes optional values that are there for such that may not be; preset dev looks for those.
      target_compile_options(${target} PRIVATE -O1 -Wno-maybe-uninitialized)
    endif()
    set(scope PUBLIC)
  else()
    add_library(${target} INTERFACE)
    target_include_directories(${target} INTERFACE $<BUILD_INTERFACE:${root}>)
    target_link_libraries(${target} INTERFACE ${arg_LINKS} ${arg_LIBRARIES})
    set(scope INTERFACE)
  endif()
  if(arg_PUBLIC_HEADERS)
    target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${root}/${arg_PUBLIC_HEADERS}>
                               $<INSTALL_INTERFACE:include>)
  endif()
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  add_library(toftwin::${name} ALIAS ${target})
endfunction()

# LIBRARIES are other people's: one of ours there would go round the check of layers.
function(_toftwin_check_libraries name libraries)
  foreach(library IN LISTS libraries)
    if(library MATCHES "toftwin(::|_)" AND NOT library MATCHES "toftwin_options")
      message(FATAL_ERROR "toftwin::${name} names ${library} under LIBRARIES: a library of ours belongs under "
                          "LINKS, where its layer is checked (docs/architecture.md).")
    endif()
  endforeach()
endfunction()

# Includes of "folder/header.h" start at the project's root: each must lie in one of `reachable`. The root is an
# include folder, so that <folder/header.h> finds them too.
function(_toftwin_check_includes name folder reachable)
  file(GLOB_RECURSE files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.h
       ${PROJECT_SOURCE_DIR}/${folder}/*.cpp)
  foreach(file IN LISTS files)
    file(STRINGS ${file} includes REGEX "^[ \t]*#[ \t]*include[ \t]*[\"<]")
    foreach(include IN LISTS includes)
      string(REGEX REPLACE "^[^\"<]*[\"<]([^\">]*)[\">].*" "\\1" path "${include}")
      if(include MATCHES "<" AND NOT EXISTS ${PROJECT_SOURCE_DIR}/${path})
        continue()
      endif()
      set(allowed FALSE)
      foreach(place IN LISTS reachable)
        string(FIND "${path}" "${place}/" at)
        if(at EQUAL 0)
          set(allowed TRUE)
        endif()
      endforeach()
      if(NOT allowed)
        file(RELATIVE_PATH where ${PROJECT_SOURCE_DIR} ${file})
        message(FATAL_ERROR "${where} includes \"${path}\", which toftwin::${name} may not use: it "
                            "reaches ${reachable}. Link the library if it is in a lower layer, or "
                            "move the code (docs/architecture.md).")
      endif()
    endforeach()
  endforeach()
endfunction()

# toftwin_program(<name> FOLDER <folder> SOURCES … LINKS … [LIBRARIES …]): an executable above all
# layers, installed as a component of its own name, with the same include check.
function(toftwin_program name)
  cmake_parse_arguments(arg "" "FOLDER" "SOURCES;LINKS;LIBRARIES" ${ARGN})
  set(reachable ${arg_FOLDER})
  foreach(link IN LISTS arg_LINKS)
    get_property(link_reachable GLOBAL PROPERTY toftwin_reachable_${link})
    list(APPEND reachable ${link_reachable})
  endforeach()
  _toftwin_check_libraries(${name} "${arg_LIBRARIES}")
  _toftwin_check_includes(${name} ${arg_FOLDER} "${reachable}")
  list(TRANSFORM arg_LINKS PREPEND toftwin::)
  list(TRANSFORM arg_SOURCES PREPEND ${PROJECT_SOURCE_DIR}/${arg_FOLDER}/)
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${arg_LINKS} ${arg_LIBRARIES} toftwin_options)
  install(TARGETS ${name} COMPONENT ${name})
endfunction()

# SPDX-License-Identifier: Apache-2.0
# Parts that need something which not every machine has.

# toftwin_optional(<NAME> <what it is> FOUND <whether what it needs is there> NEEDS <what that is>
#                  [PACKAGE <Debian package that brings it>])
# Makes the cache variable TOFTWIN_<NAME> and sets TOFTWIN_HAS_<NAME>. AUTO takes what is there, ON
# insists, OFF leaves it out. A driver that is left out stays a row of the table, which says how to
# get it (drivers/not_built.h).
function(toftwin_optional name what)
  cmake_parse_arguments(arg "" "FOUND;NEEDS;PACKAGE" "" ${ARGN})
  set(TOFTWIN_${name} AUTO CACHE STRING "${what}: AUTO, ON or OFF")
  set_property(CACHE TOFTWIN_${name} PROPERTY STRINGS AUTO ON OFF)
  string(TOUPPER "${TOFTWIN_${name}}" wish)
  set(remedy "Install it")
  if(arg_PACKAGE)
    set(remedy "Run: apt-get install ${arg_PACKAGE}")
  endif()
  set(has FALSE)
  if(wish STREQUAL "AUTO")
    if(arg_FOUND)
      set(has TRUE)
    endif()
    set(why "${arg_NEEDS} is not there. ${remedy}, and configure again")
  elseif(NOT wish)
    set(why "TOFTWIN_${name} is OFF")
  elseif(arg_FOUND)
    set(has TRUE)
  else()
    message(FATAL_ERROR "TOFTWIN_${name} is ON, but ${arg_NEEDS} is not there. ${remedy}, or say "
                        "-DTOFTWIN_${name}=AUTO to build without it.")
  endif()
  set(TOFTWIN_HAS_${name} ${has} CACHE INTERNAL "")
  if(has)
    set_property(GLOBAL APPEND PROPERTY toftwin_with "${what}")
  else()
    set_property(GLOBAL APPEND PROPERTY toftwin_without "${what}: ${why}")
  endif()
endfunction()

# Says at the end of configuring what was found and what was not.
function(toftwin_optional_summary)
  get_property(with GLOBAL PROPERTY toftwin_with)
  get_property(without GLOBAL PROPERTY toftwin_without)
  if(with)
    list(JOIN with ", " with)
    message(STATUS "With: ${with}")
  endif()
  foreach(one IN LISTS without)
    message(STATUS "Without: ${one}")
  endforeach()
endfunction()

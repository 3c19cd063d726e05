# SPDX-License-Identifier: Apache-2.0
# Like tests/protocol/fuzz.cmake, for all that reads a text. They hold most of this project, which takes long to compile: they
# are built where TOFTWIN_FUZZ_READERS is on, as tools/fuzz has it; tests/settings/mutants_test.cpp is their short form.
option(TOFTWIN_FUZZ_READERS "Build the libFuzzer targets of scenes, cameras, plans and the daemon's configuration" OFF)
if(TOFTWIN_FUZZ_READERS)
  set(folder ${PROJECT_SOURCE_DIR}/tests/settings)
  add_library(fuzz_readers STATIC ${folder}/readers.cpp)
  target_compile_definitions(fuzz_readers PRIVATE TOFTWIN_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_link_libraries(fuzz_readers PUBLIC toftwin::compare toftwin::loop toftwin::plan toftwin::suit toftwin::daemon
                        toftwin::drivers toftwin::sensor toftwin::tracer)
  foreach(reader scene camera plan case model daemon json)
    add_executable(fuzz_${reader} ${folder}/fuzz_reader.cpp)
    target_compile_definitions(fuzz_${reader} PRIVATE TOFTWIN_READER="${reader}")
    target_include_directories(fuzz_${reader} PRIVATE ${PROJECT_SOURCE_DIR})
    target_link_libraries(fuzz_${reader} PRIVATE fuzz_readers)
    target_link_options(fuzz_${reader} PRIVATE -fsanitize=fuzzer)
    add_dependencies(fuzzers fuzz_${reader})
    file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_${reader}_corpus)
    add_test(NAME fuzz_${reader}
             COMMAND fuzz_${reader} -max_total_time=3 -max_len=16384 -rss_limit_mb=2048 -timeout=20 -print_final_stats=1
                     ${CMAKE_BINARY_DIR}/fuzz_${reader}_corpus ${folder}/corpus/${reader})
    set_tests_properties(fuzz_${reader} PROPERTIES TIMEOUT 120)
  endforeach()
endif()

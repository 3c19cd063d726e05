# SPDX-License-Identifier: Apache-2.0
# Like tests/protocol/fuzz.cmake, for recordings and for settings in TOML.
set(folder ${PROJECT_SOURCE_DIR}/tests/record)
foreach(target mcap settings)
  add_executable(fuzz_${target} ${folder}/fuzz_${target}.cpp)
  target_link_options(fuzz_${target} PRIVATE -fsanitize=fuzzer)
  add_dependencies(fuzzers fuzz_${target})
  file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_${target}_corpus)
  add_test(NAME fuzz_${target}
           COMMAND fuzz_${target} -max_total_time=3 -max_len=32768 -print_final_stats=1
                   ${CMAKE_BINARY_DIR}/fuzz_${target}_corpus ${folder}/${target}_corpus)
  set_tests_properties(fuzz_${target} PROPERTIES TIMEOUT 120)
endforeach()
target_link_libraries(fuzz_mcap PRIVATE toftwin::record)
target_link_libraries(fuzz_settings PRIVATE toftwin::settings)

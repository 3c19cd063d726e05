# SPDX-License-Identifier: Apache-2.0
# Like tests/protocol/fuzz.cmake, for people's tables.
set(folder ${PROJECT_SOURCE_DIR}/tests/table)
add_executable(fuzz_table ${folder}/fuzz_table.cpp)
target_link_libraries(fuzz_table PRIVATE toftwin::table fmt::fmt)
target_link_options(fuzz_table PRIVATE -fsanitize=fuzzer)
add_dependencies(fuzzers fuzz_table)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_table_corpus)
add_test(NAME fuzz_table
         COMMAND fuzz_table -max_total_time=3 -max_len=2048 -print_final_stats=1
                 ${CMAKE_BINARY_DIR}/fuzz_table_corpus ${folder}/corpus)
set_tests_properties(fuzz_table PROPERTIES TIMEOUT 120)

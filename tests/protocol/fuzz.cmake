# SPDX-License-Identifier: Apache-2.0
# The libFuzzer target (preset "fuzz", needs clang) and a test that runs it for some seconds, starting
# from the conformance pairs. Findings lie beside the build.
enable_testing()
add_custom_target(fuzzers)  # all of them: what the preset builds
set(folder ${PROJECT_SOURCE_DIR}/tests/protocol)
add_executable(fuzz_decode ${folder}/fuzz_decode.cpp ${folder}/fuzz_one_input.cpp)
target_link_libraries(fuzz_decode PRIVATE toftwin::wire)
target_link_options(fuzz_decode PRIVATE -fsanitize=fuzzer)
add_dependencies(fuzzers fuzz_decode)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_corpus)
add_test(NAME fuzz_decode
         COMMAND fuzz_decode -max_total_time=3 -max_len=8192 -print_final_stats=1
                 ${CMAKE_BINARY_DIR}/fuzz_corpus ${folder}/conformance)
set_tests_properties(fuzz_decode PROPERTIES TIMEOUT 120)

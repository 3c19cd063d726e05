# SPDX-License-Identifier: Apache-2.0
# Like tests/protocol/fuzz.cmake, for bags and the messages in them. Of toftwin::import only what reads them.
set(folder ${PROJECT_SOURCE_DIR}/tests/tools/import)
set(bag bag/bag_frames.cpp bag/clouds.cpp bag/db3_bag.cpp bag/images.cpp bag/mcap_bag.cpp bag/open.cpp bag/pending.cpp bag/ros1_bag.cpp
        bag/topic_role.cpp bag/transforms.cpp lens/lens_of_info.cpp lens/lens_of_points.cpp)
list(TRANSFORM bag PREPEND ${PROJECT_SOURCE_DIR}/tools/cli/import/)
add_executable(fuzz_bag ${folder}/fuzz_bag.cpp ${bag} ${PROJECT_SOURCE_DIR}/drivers/ray_fit.cpp)
set_target_properties(fuzz_bag PROPERTIES UNITY_BUILD OFF)
target_include_directories(fuzz_bag PRIVATE ${PROJECT_SOURCE_DIR})
target_include_directories(fuzz_bag SYSTEM PRIVATE ${TOFTWIN_SQLITE_INCLUDE})
target_link_libraries(fuzz_bag PRIVATE toftwin::record toftwin::foxglove toftwin::ros toftwin::pictures fmt::fmt ${TOFTWIN_SQLITE} ${TOFTWIN_BZ2})
target_link_options(fuzz_bag PRIVATE -fsanitize=fuzzer)
add_dependencies(fuzzers fuzz_bag)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_bag_corpus)
add_test(NAME fuzz_bag
         COMMAND fuzz_bag -max_total_time=3 -max_len=32768 -print_final_stats=1 ${CMAKE_BINARY_DIR}/fuzz_bag_corpus ${folder}/bag_corpus)
set_tests_properties(fuzz_bag PROPERTIES TIMEOUT 120)

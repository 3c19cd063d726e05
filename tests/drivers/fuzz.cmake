# SPDX-License-Identifier: Apache-2.0
# Like tests/protocol/fuzz.cmake, for what cameras and their clients send.
set(folder ${PROJECT_SOURCE_DIR}/tests/drivers)
add_executable(fuzz_o3d303 ${folder}/fuzz_o3d303.cpp ${folder}/o3d303_fuzz_one_input.cpp
               ${PROJECT_SOURCE_DIR}/drivers/o3d303/frame_images.cpp)
target_link_libraries(fuzz_o3d303 PRIVATE toftwin::o3d303_wire)
target_link_options(fuzz_o3d303 PRIVATE -fsanitize=fuzzer)
add_dependencies(fuzzers fuzz_o3d303)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_o3d303_corpus)
add_test(NAME fuzz_o3d303
         COMMAND fuzz_o3d303 -max_total_time=3 -max_len=4096 -print_final_stats=1
                 ${CMAKE_BINARY_DIR}/fuzz_o3d303_corpus ${folder}/o3d303_corpus)
set_tests_properties(fuzz_o3d303 PROPERTIES TIMEOUT 120)

# Without the decoder and the effects, of which it takes numbers in headers alone.
set(kinect2 ${PROJECT_SOURCE_DIR}/drivers/kinect2)
add_executable(fuzz_kinect2 ${folder}/fuzz_kinect2.cpp ${folder}/kinect2_fuzz_one_input.cpp
               ${folder}/emulated_kinect2.cpp ${kinect2}/assembly.cpp ${kinect2}/commands.cpp
               ${kinect2}/samples.cpp)
target_link_libraries(fuzz_kinect2 PRIVATE toftwin::images fmt::fmt)
target_link_options(fuzz_kinect2 PRIVATE -fsanitize=fuzzer)
add_dependencies(fuzzers fuzz_kinect2)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_kinect2_corpus)
add_test(NAME fuzz_kinect2
         COMMAND fuzz_kinect2 -max_total_time=3 -max_len=512 -print_final_stats=1
                 ${CMAKE_BINARY_DIR}/fuzz_kinect2_corpus ${folder}/kinect2_corpus)
set_tests_properties(fuzz_kinect2 PROPERTIES TIMEOUT 120)

# Without libaravis: what reads bytes knows nothing of it.
set(aravis ${PROJECT_SOURCE_DIR}/drivers/aravis)
add_executable(fuzz_aravis ${folder}/fuzz_aravis.cpp ${folder}/aravis_fuzz_one_input.cpp
               ${aravis}/images.cpp ${aravis}/pixel_format.cpp ${aravis}/discovery.cpp ${aravis}/frame_ids.cpp
               ${PROJECT_SOURCE_DIR}/drivers/lens.cpp ${PROJECT_SOURCE_DIR}/drivers/clock_fit.cpp
               ${PROJECT_SOURCE_DIR}/drivers/pace.cpp)
target_link_libraries(fuzz_aravis PRIVATE toftwin::settings toftwin::images toftwin::calibration fmt::fmt)
target_link_options(fuzz_aravis PRIVATE -fsanitize=fuzzer)
add_dependencies(fuzzers fuzz_aravis)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_aravis_corpus)
add_test(NAME fuzz_aravis
         COMMAND fuzz_aravis -max_total_time=3 -max_len=512 -print_final_stats=1
                 ${CMAKE_BINARY_DIR}/fuzz_aravis_corpus ${folder}/aravis_corpus)
set_tests_properties(fuzz_aravis PROPERTIES TIMEOUT 120)

# Heads of an O3R and the Visionary; what the facades' fuzzers have is not here again.
set(drivers ${PROJECT_SOURCE_DIR}/drivers)
find_package(nlohmann_json REQUIRED)
add_executable(fuzz_heads ${folder}/fuzz_heads.cpp ${drivers}/o3r/frame_images.cpp ${drivers}/o3r/head.cpp
               ${drivers}/visionary/frame_images.cpp ${drivers}/lens.cpp ${drivers}/ray_fit.cpp)
target_link_libraries(fuzz_heads PRIVATE toftwin::o3r_wire toftwin::visionary_wire toftwin::settings toftwin::images
                      toftwin::calibration nlohmann_json::nlohmann_json fmt::fmt)
target_link_options(fuzz_heads PRIVATE -fsanitize=fuzzer)
add_dependencies(fuzzers fuzz_heads)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_heads_corpus)
add_test(NAME fuzz_heads
         COMMAND fuzz_heads -max_total_time=3 -max_len=4096 -print_final_stats=1
                 ${CMAKE_BINARY_DIR}/fuzz_heads_corpus ${folder}/heads_corpus)
set_tests_properties(fuzz_heads PROPERTIES TIMEOUT 120)

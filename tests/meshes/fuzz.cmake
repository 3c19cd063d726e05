# SPDX-License-Identifier: Apache-2.0
# Like tests/protocol/fuzz.cmake, for the readers of meshes and pictures; a short run of each is a test.
set(folder ${PROJECT_SOURCE_DIR}/tests/meshes)
function(toftwin_mesh_fuzzer name)
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  add_dependencies(fuzzers ${name})
  file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/${name}_corpus)
  add_test(NAME ${name}
           COMMAND ${name} -max_total_time=3 -max_len=4096 -rss_limit_mb=1024 -timeout=2 -print_final_stats=1
                   ${CMAKE_BINARY_DIR}/${name}_corpus ${folder}/corpus)
  set_tests_properties(${name} PROPERTIES TIMEOUT 120)
endfunction()
foreach(format Ply Obj Stl Gltf)
  string(TOLOWER fuzz_${format} name)
  add_executable(${name} ${folder}/fuzz_mesh.cpp)
  target_compile_definitions(${name} PRIVATE TOFTWIN_READER=read${format})
  target_link_libraries(${name} PRIVATE toftwin::meshes)
  toftwin_mesh_fuzzer(${name})
endforeach()
add_executable(fuzz_picture ${folder}/fuzz_picture.cpp)
target_link_libraries(fuzz_picture PRIVATE toftwin::pictures)
toftwin_mesh_fuzzer(fuzz_picture)

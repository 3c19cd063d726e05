# SPDX-License-Identifier: Apache-2.0
# Like tests/protocol/fuzz.cmake, for what clients of facades send. Without sockets, sources or threads.
find_package(Boost 1.74 REQUIRED)
set(folder ${PROJECT_SOURCE_DIR}/tests/daemon/facades)
set(facades ${PROJECT_SOURCE_DIR}/daemon/facades)

# fuzz_<name>_facade of what <name>_fuzz_one_input.cpp and the sources take, from <name>_facade_corpus.
function(toftwin_fuzz_facade name)
  add_executable(fuzz_${name}_facade ${folder}/fuzz_facades.cpp ${folder}/${name}_fuzz_one_input.cpp ${ARGN})
  target_include_directories(fuzz_${name}_facade PRIVATE ${PROJECT_SOURCE_DIR})
  target_compile_definitions(fuzz_${name}_facade PRIVATE TOFTWIN_VERSION="${PROJECT_VERSION}")
  target_link_libraries(fuzz_${name}_facade PRIVATE toftwin::o3d303_wire toftwin::settings Boost::headers fmt::fmt)
  target_link_options(fuzz_${name}_facade PRIVATE -fsanitize=fuzzer)
  add_dependencies(fuzzers fuzz_${name}_facade)
  file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz_${name}_facade_corpus)
  add_test(NAME fuzz_${name}_facade
           COMMAND fuzz_${name}_facade -max_total_time=3 -max_len=4096 -print_final_stats=1
                   ${CMAKE_BINARY_DIR}/fuzz_${name}_facade_corpus ${folder}/${name}_facade_corpus)
  set_tests_properties(fuzz_${name}_facade PROPERTIES TIMEOUT 120)
endfunction()

set(ifm commands.cpp discovery.cpp request_check.cpp)
list(TRANSFORM ifm PREPEND ${facades}/ifm/)
set(o3d303 answers.cpp auto_exposure.cpp bindings.cpp clipping.cpp device.cpp device_application.cpp device_edit.cpp
           device_frames.cpp device_source.cpp device_transfer.cpp rules.cpp schemas.cpp)
list(TRANSFORM o3d303 PREPEND ${facades}/o3d303/)
toftwin_fuzz_facade(o3d303 ${o3d303} ${ifm} ${facades}/local_place.cpp)
toftwin_fuzz_facade(ros2 ${facades}/ros2/pose.cpp)
toftwin_fuzz_facade(modbus ${facades}/modbus/identification.cpp ${facades}/modbus/registers.cpp ${facades}/modbus/requests.cpp)
set(gige_vision bootstrap_registers.cpp device.cpp device_write.cpp features.cpp genicam_xml.cpp gvcp.cpp gvsp.cpp images.cpp memory.cpp)
list(TRANSFORM gige_vision PREPEND ${facades}/gige_vision/)
toftwin_fuzz_facade(gige_vision ${gige_vision})
set(usb_camera operations.cpp transfers.cpp usb_device.cpp uvc_descriptors.cpp uvc_device.cpp)
list(TRANSFORM usb_camera PREPEND ${facades}/usb_camera/)
toftwin_fuzz_facade(usb_camera ${usb_camera})

if(TOFTWIN_HAS_OPENNI2)
  set(openni2 configuration.cpp facts.cpp images.cpp stream_settings.cpp uri.cpp)
  list(TRANSFORM openni2 PREPEND ${facades}/openni2/)
  list(APPEND openni2 ${facades}/timing/unevenness.cpp)
  toftwin_fuzz_facade(openni2 ${openni2} ${PROJECT_SOURCE_DIR}/protocol/transport/address.cpp)
  target_compile_definitions(fuzz_openni2_facade PRIVATE TOFTWIN_OPENNI2_DEFAULT_CONFIG="")
  target_include_directories(fuzz_openni2_facade PRIVATE ${PROJECT_SOURCE_DIR}/protocol/client/include)
  target_link_libraries(fuzz_openni2_facade PRIVATE PkgConfig::libopenni2)
endif()

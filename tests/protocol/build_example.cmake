# SPDX-License-Identifier: Apache-2.0
# Installs the client's package into a fresh folder and builds docs/examples/minimal-client against it:
#   cmake -DBUILD=<build folder> -DSOURCE=<example> -DWORK=<folder> -DCOMPILER=… -DFLAGS=… -P build_example.cmake
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "failed: ${ARGN}")
  endif()
endfunction()
file(REMOVE_RECURSE ${WORK})
foreach(component client development)  # as the package libtoftwin-dev needs that of the shared library
  run(${CMAKE_COMMAND} --install ${BUILD} --component ${component} --prefix ${WORK}/prefix)
endforeach()
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -G Ninja -DCMAKE_PREFIX_PATH=${WORK}/prefix
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS} -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${WORK}/build)

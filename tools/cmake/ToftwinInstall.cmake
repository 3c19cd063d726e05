# SPDX-License-Identifier: Apache-2.0
# What a program that links toftwin::client needs: find_package(toftwin) finds it. Component
# "development"; the programs install themselves (toftwin_program).
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/toftwin)
install(TARGETS toftwin_types toftwin_wire toftwin_transport toftwin_client EXPORT toftwinTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(TARGETS toftwin_shared EXPORT toftwinTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT client NAMELINK_COMPONENT development)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/protocol/include/toftwin
                  ${PROJECT_SOURCE_DIR}/protocol/client/include/toftwin
        DESTINATION include COMPONENT development FILES_MATCHING PATTERN "*.h")
install(EXPORT toftwinTargets NAMESPACE toftwin:: DESTINATION ${package_folder}
        COMPONENT development)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/toftwinConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/toftwinConfig.cmake
                              INSTALL_DESTINATION ${package_folder})
# Before 1.0 a minor version may break what links it.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/toftwinConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/toftwinConfig.cmake
              ${PROJECT_BINARY_DIR}/toftwinConfigVersion.cmake
        DESTINATION ${package_folder} COMPONENT development)

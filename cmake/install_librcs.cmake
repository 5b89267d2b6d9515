# The library as others link it, with the ABI's version in every name: components runtime and dev.
include(CMakePackageConfigHelpers)
set(rcs_headers_dir ${CMAKE_INSTALL_INCLUDEDIR}/rcs-${rcs_abi})
set(rcs_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/rcs-${rcs_abi})

install(TARGETS rcs EXPORT rcs-targets
    LIBRARY COMPONENT runtime NAMELINK_SKIP
    FILE_SET HEADERS DESTINATION ${rcs_headers_dir} COMPONENT dev
    FILE_SET generated DESTINATION ${rcs_headers_dir} COMPONENT dev)
install(TARGETS rcs_images LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/rcs-${rcs_abi} COMPONENT runtime)

install(EXPORT rcs-targets NAMESPACE rcs:: DESTINATION ${rcs_package_dir} COMPONENT dev)
configure_package_config_file(rcs-config.cmake.in rcs-config.cmake INSTALL_DESTINATION ${rcs_package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/rcs-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/rcs-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/rcs-config-version.cmake
    DESTINATION ${rcs_package_dir} COMPONENT dev)

# For -lrcs, as pkg-config says it: a link of that name in a folder of the version.
file(CREATE_LINK ../librcs.so.${rcs_abi} ${CMAKE_CURRENT_BINARY_DIR}/librcs.so SYMBOLIC)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/librcs.so DESTINATION ${CMAKE_INSTALL_LIBDIR}/rcs-${rcs_abi} COMPONENT dev)
file(RELATIVE_PATH rcs_prefix_from_pc /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(rcs.pc.in rcs-${rcs_abi}.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/rcs-${rcs_abi}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)

# Debian packages: cmake --workflow --preset package writes build/package/*.deb. Depend on what the build machine's release has, so they are made
# on the release they are for.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME rcsplat)
set(CPACK_PACKAGE_CONTACT "rcsplat developers <rcsplat@localhost.localdomain>")
set(CPACK_PACKAGE_FILE_NAME ${PROJECT_VERSION})
set(CPACK_STRIP_FILES ON)
set(CPACK_SET_DESTDIR ON)  # /etc as well as /usr
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL runtime dev service systemd protos)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# One package: its name, section, and what apt shows of it.
function(rcs_package group name section summary text)
    string(TOUPPER ${group} key)
    set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${name} PARENT_SCOPE)
    set(CPACK_DEBIAN_${key}_PACKAGE_SECTION ${section} PARENT_SCOPE)
    set(CPACK_COMPONENT_${key}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
    set(CPACK_COMPONENT_GROUP_${key}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
    # What each package has to tell of itself, in the folder of its name.
    foreach(file copyright changelog.Debian.gz)
        install(FILES ${PROJECT_BINARY_DIR}/debian/${file} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${group})
    endforeach()
endfunction()

file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/debian)
configure_file(${PROJECT_SOURCE_DIR}/docker/debian/copyright ${PROJECT_BINARY_DIR}/debian/copyright COPYONLY)
configure_file(${PROJECT_SOURCE_DIR}/docker/debian/changelog.in ${PROJECT_BINARY_DIR}/debian/changelog.Debian @ONLY)
execute_process(COMMAND gzip -9nf ${PROJECT_BINARY_DIR}/debian/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)

rcs_package(runtime librcs${rcs_abi} libs "global illumination by radiance cache splatting, library"
    "librcs renders glTF scenes with indirect light: sparse irradiance records are ray traced and splatted\nonto the image. No GPU is needed; one is used where it is there.")
rcs_package(dev librcs-dev libdevel "global illumination by radiance cache splatting, headers"
    "librcs renders glTF scenes with indirect light: sparse irradiance records are ray traced and splatted\nonto the image. These are its headers, for CMake and pkg-config.")
rcs_package(service rcsplat graphics "renders global illumination, from the command line and as a service"
    "rcsplat renders pictures and animations of glTF scenes by radiance cache splatting, compares them with\na path tracer, and serves render jobs of many users.")
foreach(component systemd protos)
    string(TOUPPER ${component} key)
    set(CPACK_COMPONENT_${key}_GROUP service)
endforeach()
foreach(component runtime dev service)
    string(TOUPPER ${component} key)
    set(CPACK_COMPONENT_${key}_GROUP ${component})
endforeach()

set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "libgl1-mesa-dri, libegl-mesa0")
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "librcs${rcs_abi} (= ${PROJECT_VERSION}-1), libglm-dev")
set(CPACK_DEBIAN_SERVICE_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_SERVICE_PACKAGE_DEPENDS "librcs${rcs_abi} (= ${PROJECT_VERSION}-1), fonts-dejavu-core")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})
set(CPACK_DEBIAN_SERVICE_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/docker/debian/conffiles
    ${PROJECT_SOURCE_DIR}/docker/debian/postinst)
include(CPack)

# Debian packages: cmake --workflow --preset package writes build/package/*.deb. Depend on what the build machine's release has, so they are made
# on the release they are for.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME rcsplat)
set(CPACK_PACKAGE_CONTACT "rcsplat developers <rcsplat@example.org>")
set(CPACK_PACKAGE_FILE_NAME ${PROJECT_VERSION})
set(CPACK_STRIP_FILES ON)
set(CPACK_SET_DESTDIR ON)  # /etc as well as /usr
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL runtime dev service systemd protos python)
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
    "librcs renders glTF scenes with indirect light: sparse irradiance records\nare ray traced and splatted onto the image. No GPU is needed; one is used\nwhere it is there.")
rcs_package(dev librcs-dev libdevel "global illumination by radiance cache splatting, headers"
    "librcs renders glTF scenes with indirect light: sparse irradiance records\nare ray traced and splatted onto the image. These are its headers, for CMake\nand pkg-config.")
rcs_package(service rcsplat graphics "renders global illumination, from the command line and as a service"
    "rcsplat renders pictures and animations of glTF scenes by radiance cache\nsplatting, compares them with a path tracer, and serves render jobs of many\nusers.")
rcs_package(python python3-rcsplat python "renders global illumination, modules for Python"
    "The module rcs renders glTF scenes by radiance cache splatting within the\nprocess; the module rcsplat is a client of rcsplat's render service.")
# The service's client, with the messages that protoc makes for it.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(rcs_client ${PROJECT_SOURCE_DIR}/service/python)
file(GLOB_RECURSE rcs_client_sources CONFIGURE_DEPENDS ${rcs_client}/src/*.py ${PROJECT_SOURCE_DIR}/proto/*.proto)
add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/python/stamp
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${PROJECT_BINARY_DIR}/python
    COMMAND ${CMAKE_COMMAND} -E env PYTHONDONTWRITEBYTECODE=1
            ${Python3_EXECUTABLE} setup.py -q egg_info -e ${PROJECT_BINARY_DIR} build_py --build-lib ${PROJECT_BINARY_DIR}/python
    COMMAND ${CMAKE_COMMAND} -E touch ${PROJECT_BINARY_DIR}/python/stamp
    WORKING_DIRECTORY ${rcs_client} DEPENDS ${rcs_client_sources} ${rcs_client}/setup.py)
add_custom_target(rcs_python_client ALL DEPENDS ${PROJECT_BINARY_DIR}/python/stamp)
install(DIRECTORY ${PROJECT_BINARY_DIR}/python/rcsplat DESTINATION ${RCS_PYTHON_DIR} COMPONENT python)

foreach(component systemd protos)
    string(TOUPPER ${component} key)
    set(CPACK_COMPONENT_${key}_GROUP service)
endforeach()
foreach(component runtime dev service python)
    string(TOUPPER ${component} key)
    set(CPACK_COMPONENT_${key}_GROUP ${component})
endforeach()

set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
configure_file(${PROJECT_SOURCE_DIR}/docker/debian/library/shlibs.in ${PROJECT_BINARY_DIR}/debian/shlibs @ONLY)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/debian/shlibs ${PROJECT_SOURCE_DIR}/docker/debian/library/triggers)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "libegl1, libopengl0")  # opened by name: no tool sees it
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "libgl1-mesa-dri, libegl-mesa0")
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "librcs${rcs_abi} (= ${PROJECT_VERSION}-1), libglm-dev")
set(CPACK_DEBIAN_SERVICE_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_SERVICE_PACKAGE_DEPENDS "librcs${rcs_abi} (= ${PROJECT_VERSION}-1), fonts-dejavu-core")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
math(EXPR rcs_next_python "${Python3_VERSION_MINOR} + 1")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.${Python3_VERSION_MINOR}~), python3 (<< 3.${rcs_next_python}), python3-numpy, python3-protobuf, librcs${rcs_abi} (= ${PROJECT_VERSION}-1)")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS python3-pil)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/docker/debian/python/postinst ${PROJECT_SOURCE_DIR}/docker/debian/python/prerm)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})
set(CPACK_DEBIAN_SERVICE_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/docker/debian/conffiles
    ${PROJECT_SOURCE_DIR}/docker/debian/postinst)
include(CPack)

# Installs the build into a folder, moves that, and looks at what a user of it meets: programs built with CMake and with pkg-config,
# rcsplat itself, the names of files, where libraries are looked for.
# cmake -D build=FOLDER -D work=FOLDER -D compiler=FILE -D flags=FLAGS -D generator=NAME -D python=FILE -D abi=VERSION -P check.cmake
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work})
run(${CMAKE_COMMAND} --install ${build} --prefix ${work}/first)
file(RENAME ${work}/first ${work}/prefix)
set(prefix ${work}/prefix)

# Programs of others.
run(${CMAKE_COMMAND} -G ${generator} -S ${CMAKE_CURRENT_LIST_DIR}/consumer -B ${work}/consumer -D CMAKE_BUILD_TYPE=Release
    -D CMAKE_CXX_COMPILER=${compiler} -D CMAKE_CXX_FLAGS=${flags} -D CMAKE_PREFIX_PATH=${prefix}
    -D CMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON)
run(${CMAKE_COMMAND} --build ${work}/consumer)
run(${work}/consumer/consumer)
run(${work}/consumer/own_symbols)

file(GLOB_RECURSE pc ${prefix}/*/rcs-${abi}.pc)
file(GLOB_RECURSE library ${prefix}/*/librcs.so.${abi})
get_filename_component(pc_folder ${pc} DIRECTORY)
get_filename_component(library_folder ${library} DIRECTORY)
set(ENV{PKG_CONFIG_PATH} ${pc_folder})
execute_process(COMMAND pkg-config --cflags --libs rcs-${abi} OUTPUT_VARIABLE words COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(words UNIX_COMMAND "${words}")
separate_arguments(flag_words UNIX_COMMAND "${flags}")
run(${compiler} -std=c++20 ${flag_words} ${CMAKE_CURRENT_LIST_DIR}/consumer/main.cpp -o ${work}/by_pkg_config ${words}
    -Wl,-rpath,${library_folder})
run(${work}/by_pkg_config)

# rcsplat finds its library, and that the module that reads pictures, wherever the folder is.
run(${prefix}/bin/rcsplat --version)
run(${prefix}/bin/rcsplat render demo:cornell --size 16x16 --aa 1 --rays 16 --quiet --output ${work}/a.exr)
run(${prefix}/bin/rcsplat compare ${work}/a.exr ${work}/a.exr)
# The module for Python, where it was built; sanitizers' libraries would have to be loaded before Python.
if(EXISTS ${prefix}/lib/python3/dist-packages/rcs AND NOT flags MATCHES fsanitize)
    file(GLOB module ${prefix}/lib/python3/dist-packages/rcs/_rcs*.so)
    run(${CMAKE_COMMAND} -E env PYTHONPATH=${prefix}/lib/python3/dist-packages PYTHONDONTWRITEBYTECODE=1
        ${python} -c "import rcs; print(rcs.__version__, rcs.demo_scene_names())")
endif()
foreach(file ${library} ${prefix}/bin/rcsplat ${module})
    file(READ_ELF ${file} RUNPATH searched RPATH searched_first)
    foreach(folder IN LISTS searched searched_first)
        if(NOT folder MATCHES "^\\$ORIGIN(/|$)")
            message(FATAL_ERROR "${file} looks for libraries in ${folder}")
        endif()
    endforeach()
endforeach()

# Two versions of the library have no file in common.
run(${CMAKE_COMMAND} --install ${build} --prefix ${work}/library --component runtime)
run(${CMAKE_COMMAND} --install ${build} --prefix ${work}/library --component dev)
file(GLOB_RECURSE files RELATIVE ${work}/library ${work}/library/*)
foreach(file IN LISTS files)
    if(NOT file MATCHES "[-.]${abi}([./]|$)")
        message(FATAL_ERROR "${file} does not tell the version ${abi} from others")
    endif()
endforeach()
file(REMOVE_RECURSE ${work})

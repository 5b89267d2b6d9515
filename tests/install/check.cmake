# Installs the build into a folder of its own, then builds and runs a program that knows only that folder.
# cmake -D build=FOLDER -D work=FOLDER -D compiler=FILE -D flags=FLAGS -P check.cmake
function(run)
    execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_VARIABLE text)
    message("${text}")
    if(code)
        message(FATAL_ERROR "failed (${code}): ${ARGN}")
    endif()
endfunction()

file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work})
run(${CMAKE_COMMAND} --install ${build} --prefix ${work}/prefix)
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/consumer -B ${work}/consumer -D CMAKE_BUILD_TYPE=Release
    -D CMAKE_CXX_COMPILER=${compiler} -D CMAKE_CXX_FLAGS=${flags} -D CMAKE_PREFIX_PATH=${work}/prefix
    -D CMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON)
run(${CMAKE_COMMAND} --build ${work}/consumer)
run(${work}/consumer/consumer)
# Wherever the folder is moved, the program finds its library, and that the module that reads pictures.
file(RENAME ${work}/prefix ${work}/moved)
run(${work}/moved/bin/rcsplat --version)
run(${work}/moved/bin/rcsplat render demo:cornell --size 16x16 --aa 1 --rays 16 --quiet --output ${work}/a.exr)
run(${work}/moved/bin/rcsplat compare ${work}/a.exr ${work}/a.exr)
file(REMOVE_RECURSE ${work})

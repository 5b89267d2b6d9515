# Builds the library as part of another project: neither the service nor tests come along, and nothing is installed.
# cmake -D source=CHECKOUT -D work=FOLDER -D compiler=FILE -D flags=FLAGS -D generator=NAME -P check_subdirectory.cmake
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${work})
set(launcher "")
find_program(ccache ccache)
if(ccache)
    set(launcher -D CMAKE_CXX_COMPILER_LAUNCHER=${ccache})
endif()
run(${CMAKE_COMMAND} -G ${generator} -S ${CMAKE_CURRENT_LIST_DIR}/subdirectory -B ${work} -D librcs=${source}
    -D CMAKE_BUILD_TYPE=Debug -D CMAKE_CXX_COMPILER=${compiler} -D CMAKE_CXX_FLAGS=${flags} ${launcher})
run(${CMAKE_COMMAND} --build ${work} --target consumer)
run(${work}/consumer)
foreach(folder service librcs/examples tests)
    if(EXISTS ${work}/librcs/${folder}/CMakeFiles OR EXISTS ${work}/librcs/librcs/${folder}/CMakeFiles)
        message(FATAL_ERROR "${folder} came along")
    endif()
endforeach()
file(REMOVE_RECURSE ${work})

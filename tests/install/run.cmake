# Runs a command and shows what it says; ends the script where the command fails.
function(run)
    execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_VARIABLE text)
    message("${text}")
    if(code)
        message(FATAL_ERROR "failed (${code}): ${ARGN}")
    endif()
endfunction()

# Writes `output`, a C++ file with the files NAMES of `folder` as text by name, so that nothing has to be found at run
# time: the definition of `function`, which `header` declares as const std::map<std::string, std::string>& function().
function(rcs_embed_texts output header function folder)
    set(entries "")
    foreach(name IN LISTS ARGN)
        set(path ${folder}/${name})
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${path})
        file(READ ${path} text)
        string(APPEND entries "    {\"${name}\", R\"text(${text})text\"},\n")
    endforeach()
    file(CONFIGURE OUTPUT ${output} @ONLY CONTENT [[
// Made by embed_texts.cmake.
#include "@header@"

const std::map<std::string, std::string>& @function@()
{
    static const std::map<std::string, std::string> texts = {
@entries@    };
    return texts;
}
]])
endfunction()

# cmake -D CHECKER=<public_headers.cmake> -D TREE=<scratch folder> -P public_headers_refuses.cmake
# Plants one fault of each kind; the checker must name it.
cmake_minimum_required(VERSION 3.25)

function(check expected)
  execute_process(COMMAND ${CMAKE_COMMAND} -D CHAPTER=${TREE}/api.md -D HEADERS=${TREE}/include
                          -D HELP=${TREE}/help.txt -P ${CHECKER}
                  RESULT_VARIABLE failed OUTPUT_VARIABLE out ERROR_VARIABLE out)
  string(FIND "${out}" "${expected}" at)
  if(expected STREQUAL "" AND failed)
    message(SEND_ERROR "a tree in order is refused:\n${out}")
  elseif(NOT expected STREQUAL "" AND (NOT failed OR at EQUAL -1))
    message(SEND_ERROR "expected a refusal with\n${expected}\ngot\n${out}")
  endif()
endfunction()

function(write_tree)
  file(REMOVE_RECURSE ${TREE})
  file(WRITE ${TREE}/api.md "| `model/model.hpp` | the seam |\n| `trim/trim.hpp` | a verb |\n\n"
       "- **Commands**: `trim`, `modes`; their options\n- **Study files**: `keys`\n")
  file(WRITE ${TREE}/help.txt "usage; more\n\nSubcommands:\n  trim   finds\n  modes  lists\n\nTry:\n  trim it\n")
  file(WRITE ${TREE}/include/model/model.hpp "#include <vector>\n")
  file(WRITE ${TREE}/include/trim/trim.hpp "#include \"model/model.hpp\"\n")
endfunction()

write_tree()
check("")
file(WRITE ${TREE}/include/trim/newton.hpp "")
check("trim/newton.hpp: installed, and not listed")
write_tree()
file(REMOVE ${TREE}/include/trim/trim.hpp)
check("trim/trim.hpp: listed, and not installed")
write_tree()
file(APPEND ${TREE}/include/trim/trim.hpp "# include \"trim/newton.hpp\"\n")
check("trim/trim.hpp: includes trim/newton.hpp, which is not installed")
write_tree()
file(APPEND ${TREE}/api.md "| `trim/trim.hpp` | again |\n")
check("trim/trim.hpp: listed twice")
write_tree()
file(WRITE ${TREE}/api.md "| `model/model.hpp` | the seam |\n| `trim/trim.hpp` | a verb |\n\n"
     "- **Commands**: `trim`; their options\n")
check("commands: listed are trim; the program has modes;trim")
file(REMOVE_RECURSE ${TREE})

# cmake -D CHECKER=<layering.cmake> -D TREE=<scratch folder> -P layering_refuses.cmake
# Plants one violation of each kind in a tiny tree; the checker must name file, line and reason.
cmake_minimum_required(VERSION 3.25)

function(write_tree)
  file(REMOVE_RECURSE ${TREE})
  file(WRITE ${TREE}/CMakeLists.txt "tiltrim_module(model HEADERS model.hpp SOURCES model.cpp)\n"
       "tiltrim_module(trim HEADERS trim.hpp SOURCES trim.cpp USES model)\n"
       "tiltrim_module(linearize\n  HEADERS linearize.hpp  # not trim\n  USES model)\n"
       "tiltrim_module(sweep USES trim linearize)\n")
  file(WRITE ${TREE}/model/model.hpp "#include <Eigen/Core>\n#include <vector>\n")
  file(WRITE ${TREE}/model/private.hpp "#include <boost/numeric/interval.hpp>\n")
  file(WRITE ${TREE}/trim/trim.hpp "#include \"model/model.hpp\"\n")
  file(WRITE ${TREE}/trim/trim.cpp "#include \"trim/trim.hpp\"\n#include <IpIpoptApplication.hpp>\n")
  file(WRITE ${TREE}/linearize/linearize.hpp "#include \"model/model.hpp\"\n")
  file(WRITE ${TREE}/sweep/sweep.cpp "#include \"model/model.hpp\"\n#include \"trim/trim.hpp\"\n")
endfunction()

function(check expected)
  execute_process(COMMAND ${CMAKE_COMMAND} -D ROOT=${TREE} -P ${CHECKER}
                  RESULT_VARIABLE failed OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(expected STREQUAL "")
    if(failed)
      message(SEND_ERROR "a tree in order is refused:\n${out}")
    endif()
    return()
  endif()
  string(FIND "${out}" "${expected}" at)
  if(NOT failed OR at EQUAL -1)
    message(SEND_ERROR "expected a refusal with\n${expected}\ngot\n${out}")
  endif()
endfunction()

function(plant file text expected)
  write_tree()
  file(APPEND ${TREE}/${file} "${text}\n")
  check("${file}:${expected}")
endfunction()

write_tree()
check("")
plant(linearize/linearize.hpp "#include \"trim/trim.hpp\""
      "2: #include \"trim/trim.hpp\"  -- linearize does not USE trim")
plant(linearize/modes.cpp "  # include <trim/trim.hpp>  // sly"
      "1:   # include <trim/trim.hpp>  // sly  -- linearize does not USE trim")
plant(model/model.cpp "#include \"../trim/trim.hpp\"" "1: #include \"../trim/trim.hpp\"  -- ours are")
plant(model/model.hpp "#include <fmt/core.h>"
      "3: #include <fmt/core.h>  -- a public header carries nothing but Eigen")
plant(trim/newton.cpp "#include <Eigen/LU>" "1: #include <Eigen/LU>  -- of Eigen, only dense/ includes more than Core")
plant(trim/trim.hpp "#include \"model/private.hpp\""
      "2: #include \"model/private.hpp\"  -- a public header includes one that is not")
plant(trim/problem.hpp "#include <IpTNLP.hpp>"
      "1: #include <IpTNLP.hpp>  -- Ipopt is included in one .cpp only")
plant(trim/trim_too.cpp "#include <IpTNLP.hpp>"
      "1: #include <IpTNLP.hpp>  -- Ipopt is included in trim/trim.cpp already")
plant(linearize/modes.cpp "const char* state = \"gamma\";" "1: \"gamma\"  -- linearize is for every vehicle")
plant(linearize/private.hpp "#pragma once" "1: model/private.hpp has the same name  -- one header of a name")
write_tree()
file(APPEND ${TREE}/CMakeLists.txt "tiltrim_module(vehicles/glider SOURCES glider.cpp USES trim)\n")
file(WRITE ${TREE}/vehicles/glider/glider.cpp "#include \"vehicles/glider/glider.hpp\"\n#include \"trim/trim.hpp\"\n")
check("")
file(APPEND ${TREE}/trim/trim.cpp "#include \"vehicles/glider/glider.hpp\"\n")
check("trim/trim.cpp:3: #include \"vehicles/glider/glider.hpp\"  -- trim is for every vehicle")
file(REMOVE_RECURSE ${TREE})

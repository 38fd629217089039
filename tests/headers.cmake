# cmake -D COMPILER=<c++> -D ROOT=<source tree> -D INCLUDES=<folders of Eigen> -D HEADERS=<folder/header.hpp>...
#       -P headers.cmake
# Every public header compiles alone, without a warning: it includes what it needs. Only read, not
# translated: a header has no code to speak of.
cmake_minimum_required(VERSION 3.25)

if(NOT HEADERS)
  message(FATAL_ERROR "no public headers")
endif()
list(TRANSFORM INCLUDES PREPEND -isystem)
set(source ${CMAKE_CURRENT_BINARY_DIR}/header_alone.cpp)
set(faults 0)
foreach(header IN LISTS HEADERS)
  file(WRITE ${source} "#include \"${header}\"\n")
  execute_process(COMMAND ${COMPILER} -std=c++20 -fsyntax-only -Wall -Wextra -Wpedantic -Werror
                  -I${ROOT} ${INCLUDES} ${source} RESULT_VARIABLE failed)
  if(failed)
    message("${header}: does not compile alone")
    math(EXPR faults "${faults} + 1")
  endif()
endforeach()
file(REMOVE ${source})
list(LENGTH HEADERS count)
if(faults)
  message(FATAL_ERROR "${faults} of ${count} public headers do not compile alone")
endif()
message("${count} public headers compile alone")

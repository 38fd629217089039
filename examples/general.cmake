# cmake -D BUILD=<build> -D NINJA=<ninja> -D TARGET=<file> -P general.cmake
# Checks that everything the target is built from lies outside the folders of particular vehicles
# and of studies: the library of the general folders is self-contained.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND ${NINJA} -C ${BUILD} -t inputs ${TARGET} OUTPUT_VARIABLE inputs COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" inputs "${inputs}")
set(libraries 0)
foreach(input IN LISTS inputs)
  if(input MATCHES "(^|/)(lib)?(tiltrim_)?(vehicles|tiltrotor|flight|study|tables|report|cli)(/|\\.|$)")
    message(SEND_ERROR "${TARGET} is built from ${input}")
  endif()
  if(input MATCHES "libtiltrim_(trim|linearize|follow|sweep|simulate|tune)\\.a$")
    math(EXPR libraries "${libraries} + 1")
  endif()
endforeach()
if(libraries LESS 6)
  message(FATAL_ERROR "of the six verbs ${TARGET} links ${libraries}")
endif()

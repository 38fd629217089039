# cmake -D BUILD=<build folder> -D SCRATCH=<folder> ... -P install.cmake
# Installs, moves what is installed, and outside the source tree builds and runs the program of
# docs/your-model.md with it, as printed there. What is installed is what docs/api.md lists.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# The first block of the chapter in this language, in `text`.
function(chapter_block language)
  file(READ ${CMAKE_CURRENT_LIST_DIR}/../docs/your-model.md chapter)
  string(FIND "${chapter}" "\n```${language}\n" from)
  if(from EQUAL -1)
    message(FATAL_ERROR "docs/your-model.md: expected a block of ${language}")
  endif()
  string(LENGTH "\n```${language}\n" fence)
  math(EXPR from "${from} + ${fence}")
  string(SUBSTRING "${chapter}" ${from} -1 rest)
  string(FIND "${rest}" "\n```\n" to)
  string(SUBSTRING "${rest}" 0 ${to} found)
  set(text "${found}\n" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${SCRATCH})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${SCRATCH}/first)
file(RENAME ${SCRATCH}/first ${SCRATCH}/moved)  # nothing installed may know where it was
execute_process(COMMAND ${SCRATCH}/moved/bin/tiltrim --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)
run(${CMAKE_COMMAND} -D CHAPTER=${CMAKE_CURRENT_LIST_DIR}/../docs/api.md
    -D HEADERS=${SCRATCH}/moved/include/tiltrim -D "COMMANDS=${help}"
    -P ${CMAKE_CURRENT_LIST_DIR}/public_headers.cmake)
set(user ${SCRATCH}/levitation)
chapter_block(cmake)
file(WRITE ${user}/CMakeLists.txt "${text}")
chapter_block(cpp)
file(WRITE ${user}/main.cpp "${text}")
run(${CMAKE_COMMAND} -S ${user} -B ${user}/build -G ${GENERATOR}
    -D CMAKE_PREFIX_PATH=${SCRATCH}/moved -D CMAKE_BUILD_TYPE=${CONFIG}
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${user}/build)
execute_process(COMMAND ${user}/build/levitation OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
chapter_block(text)
if(NOT printed STREQUAL text)
  message(FATAL_ERROR "docs/your-model.md says it prints\n${text}but it prints\n${printed}")
endif()
run(${SCRATCH}/moved/bin/tiltrim linearize ${SCRATCH}/moved/share/tiltrim/studies/paper.toml)
file(REMOVE_RECURSE ${SCRATCH})

# cmake -D BUILD=<build folder> -D SCRATCH=<folder> ... -P install.cmake
# Installs, moves the installation, and outside the source tree builds and runs with it the program
# of docs/your-model.md, as printed there, with differences and with exact derivatives. The installed
# files must be those listed in docs/api.md.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# The first block in this language below the chapter's heading, in `text`.
function(chapter_block language heading)
  file(READ ${CMAKE_CURRENT_LIST_DIR}/../docs/your-model.md chapter)
  string(FIND "${chapter}" "\n${heading}\n" from)
  if(from EQUAL -1)
    message(FATAL_ERROR "docs/your-model.md: expected the heading ${heading}")
  endif()
  string(SUBSTRING "${chapter}" ${from} -1 chapter)
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
execute_process(COMMAND ${SCRATCH}/moved/bin/tiltrim --help OUTPUT_FILE ${SCRATCH}/help.txt
                COMMAND_ERROR_IS_FATAL ANY)
run(${CMAKE_COMMAND} -D CHAPTER=${CMAKE_CURRENT_LIST_DIR}/../docs/api.md
    -D HEADERS=${SCRATCH}/moved/include/tiltrim -D HELP=${SCRATCH}/help.txt
    -P ${CMAKE_CURRENT_LIST_DIR}/public_headers.cmake)

# Builds and runs ${main} in ${user}; its output must match the chapter.
function(build_and_run)
  file(WRITE ${user}/main.cpp "${main}")
  run(${CMAKE_COMMAND} --build ${user}/build)
  execute_process(COMMAND ${user}/build/levitation OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
  chapter_block(text "## The program")
  if(NOT printed STREQUAL text)
    message(FATAL_ERROR "docs/your-model.md says it prints\n${text}but of\n${main}it prints\n${printed}")
  endif()
endfunction()

set(user ${SCRATCH}/levitation)
chapter_block(cmake "## The folder")
file(WRITE ${user}/CMakeLists.txt "${text}")
chapter_block(cpp "## The program")
set(main "${text}")
file(WRITE ${user}/main.cpp "${main}")
run(${CMAKE_COMMAND} -S ${user} -B ${user}/build -G ${GENERATOR}
    -D CMAKE_PREFIX_PATH=${SCRATCH}/moved -D CMAKE_BUILD_TYPE=${CONFIG}
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_CXX_FLAGS=${FLAGS})
build_and_run()
chapter_block(cpp "## Exact derivatives")  # in place of the two models
string(FIND "${main}" "Model magnet()" from)
string(FIND "${main}" "int main()" to)
string(SUBSTRING "${main}" 0 ${from} before)
string(SUBSTRING "${main}" ${to} -1 behind)
set(main "${before}${text}\n${behind}")
build_and_run()

# Numbers that are pure round-off, and the column widths they cause, are not compared.
function(without_rounding name)
  string(REGEX REPLACE "[0-9.]+e-[0-9]+" "tiny" text "${${name}}")
  string(REGEX REPLACE " +" " " text "${text}")
  set(${name} "${text}" PARENT_SCOPE)
endfunction()

chapter_block(toml "## Without compiling")
file(WRITE ${user}/ball.toml "${text}")
set(printed "")
foreach(command linearize follow)
  execute_process(COMMAND ${SCRATCH}/moved/bin/tiltrim ${command} ball.toml WORKING_DIRECTORY ${user}
                  OUTPUT_VARIABLE answer COMMAND_ERROR_IS_FATAL ANY)
  string(APPEND printed "${answer}")
  if(command STREQUAL linearize)
    string(APPEND printed "\n")
  endif()
endforeach()
chapter_block(text "## Without compiling")
without_rounding(text)
without_rounding(printed)
if(NOT printed STREQUAL text)
  message(FATAL_ERROR "docs/your-model.md says of ball.toml\n${text}but it is\n${printed}")
endif()
run(${SCRATCH}/moved/bin/tiltrim linearize ${SCRATCH}/moved/share/tiltrim/studies/paper.toml)
file(REMOVE_RECURSE ${SCRATCH})

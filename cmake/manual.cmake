# cmake -D PROGRAM=<tiltrim> -D SHARE=<folder> -P manual.cmake: its manual and completion scripts, where systems look for them.
function(printed file)
  cmake_path(GET file PARENT_PATH folder)
  file(MAKE_DIRECTORY ${folder})
  execute_process(COMMAND ${PROGRAM} ${ARGN} OUTPUT_FILE ${file} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

printed(${SHARE}/bash-completion/completions/tiltrim completion bash)
printed(${SHARE}/zsh/vendor-completions/_tiltrim completion zsh)
printed(${SHARE}/fish/vendor_completions.d/tiltrim.fish completion fish)
printed(${SHARE}/man/man1/tiltrim.1 manual)
file(STRINGS ${SHARE}/man/man1/tiltrim.1 pages REGEX "^\\.BR tiltrim")  # what it refers to
foreach(page IN LISTS pages)
  string(REGEX REPLACE "^.*tiltrim[^a-z]*([a-z]+(-[a-z]+)*).*$" "\\1" command "${page}")
  printed(${SHARE}/man/man1/tiltrim-${command}.1 manual ${command})
endforeach()
file(GLOB pages ${SHARE}/man/man1/*.1)
execute_process(COMMAND gzip -9nf ${pages} COMMAND_ERROR_IS_FATAL ANY)

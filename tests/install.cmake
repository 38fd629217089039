# cmake -D BUILD=<build folder> -D SCRATCH=<folder> ... -P install.cmake
# Installs, moves what is installed, and builds and runs a project outside the source tree with it.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${SCRATCH})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${SCRATCH}/first)
file(RENAME ${SCRATCH}/first ${SCRATCH}/moved)  # nothing installed may know where it was
file(COPY ${CMAKE_CURRENT_LIST_DIR}/install/ DESTINATION ${SCRATCH}/pendulum)
run(${CMAKE_COMMAND} -S ${SCRATCH}/pendulum -B ${SCRATCH}/pendulum/build -G ${GENERATOR}
    -D CMAKE_PREFIX_PATH=${SCRATCH}/moved -D CMAKE_BUILD_TYPE=${CONFIG}
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${SCRATCH}/pendulum/build)
run(${SCRATCH}/pendulum/build/pendulum)
run(${SCRATCH}/moved/bin/tiltrim linearize ${SCRATCH}/moved/share/tiltrim/studies/paper.toml)
file(REMOVE_RECURSE ${SCRATCH})

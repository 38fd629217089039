# tiltrim_module(<folder> [COLD] HEADERS ... SOURCES ... USES ... LINKS ... HEADERS_OF ...)
# A folder is a target tiltrim::<folder>, by the last part of its path: what it may include is what it USES, and what those use.
# HEADERS are public: installed, listed in docs/api.md, documented.
# LINKS: libraries its users must link too. HEADERS_OF: header-only ones, needed to build it alone.
# COLD: what lasts is computed in the folders that it calls; -O1 compiles it in three quarters of the time of -O3.
function(tiltrim_module folder)
  cmake_path(GET folder FILENAME name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "COLD" "" "HEADERS;SOURCES;USES;LINKS;HEADERS_OF")
  list(TRANSFORM arg_SOURCES PREPEND ${folder}/)
  list(TRANSFORM arg_HEADERS PREPEND ${folder}/)
  add_library(tiltrim_${name} STATIC ${arg_SOURCES})
  add_library(tiltrim::${name} ALIAS tiltrim_${name})
  set_target_properties(tiltrim_${name} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(tiltrim_${name} PUBLIC cxx_std_20)
  target_sources(tiltrim_${name} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${arg_HEADERS})
  set_target_properties(tiltrim_${name} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
  set_property(GLOBAL APPEND PROPERTY TILTRIM_PUBLIC_HEADERS ${arg_HEADERS})
  set_property(GLOBAL APPEND PROPERTY TILTRIM_MODULES ${name})
  target_link_libraries(tiltrim_${name} PUBLIC Eigen3::Eigen PRIVATE ${arg_LINKS})
  foreach(used IN LISTS arg_USES)
    cmake_path(GET used FILENAME used)
    target_link_libraries(tiltrim_${name} PUBLIC tiltrim::${used})
  endforeach()
  foreach(library IN LISTS arg_HEADERS_OF)
    target_link_libraries(tiltrim_${name} PRIVATE $<BUILD_INTERFACE:${library}>)
  endforeach()
  tiltrim_compile_options(tiltrim_${name})
  tiltrim_light(tiltrim_${name} ${arg_COLD})

  # Installed, a header is <tiltrim/trim/trim.hpp>, and includes its neighbours as "model/model.hpp".
  target_include_directories(tiltrim_${name} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  install(TARGETS tiltrim_${name} EXPORT tiltrim
          FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tiltrim)
endfunction()

# Compiled in less than half the time: several sources at once share what their headers instantiate.
# dense/ has its sources apart because each is large.
function(tiltrim_light target cold)
  if(cold)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
    set(json <nlohmann/json.hpp>)
  endif()
  if(target MATCHES "_(study|report|cli|commands|design|qualities)$")  # which compute little: half the time
    target_compile_options(${target} PRIVATE $<$<CONFIG:Debug>:-O0>)
  endif()
  if(TILTRIM_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)  # clang wants all flags to be the same
    tiltrim_precompiled(${target} cold_${cold} <Eigen/Core> <algorithm> <array> <cmath> <complex> <functional> <limits> <map> <memory>
                        <optional> <span> <stdexcept> <string> <vector> ${json})
  endif()
  if(TILTRIM_UNITY AND NOT target STREQUAL tiltrim_dense)
    # As many as one compiler process takes with less than 1 GB.
    set(batch 12)
    if(target MATCHES "_(study|report)$")
      set(batch 16)
    elseif(target MATCHES "_(linearize|tune|cli)$")
      set(batch 6)
    elseif(target MATCHES "_(sweep|simulate|commands)$")
      set(batch 8)
    endif()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
    if(target MATCHES "_(model|linearize|simulate|tiltrotor|flight)$")
      # What is evaluated millions of times is inlined as if each source were alone, at a tenth of the compile time.
      target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:--param=large-unit-insns=100000>)
    endif()
  endif()
endfunction()

# Headers that most sources include are parsed once for each kind of flags: the two levels of optimisation, and each set of
# instructions; by the first target of each, one that adds no definitions, which g++ would ask of the others too.
function(tiltrim_precompiled target kind)
  get_property(first GLOBAL PROPERTY TILTRIM_PRECOMPILED_${kind})
  if(first)
    target_precompile_headers(${target} REUSE_FROM ${first})
    return()
  endif()
  set_property(GLOBAL PROPERTY TILTRIM_PRECOMPILED_${kind} ${target})
  target_precompile_headers(${target} PRIVATE ${ARGN})
endfunction()

function(tiltrim_compile_options target)
  # kB from which g++ collects its garbage: a tenth of a large unit's time, but no process may take over 1 GB.
  set(heap 260000)
  if(target MATCHES "_(runtime|model|design|trim|linearize|qualities|sweep|prove|simulate|tune|tiltrotor|xv15|flight|study|check_proof|commands|cli)$|^test_|^(cli|model|trim|report|linearize|xv15|design)_tests$")
    set(heap 600000)
  endif()
  # Contraction off: the same source gives the same bits with and without fused multiply-add.
  # Not these: g++ 12 at -O3 sees them in temporary std::strings where they are not.
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wconversion -Wpedantic -Wno-sign-conversion
    # clang sees shadows between sources that are one unit.
    $<$<NOT:$<AND:$<CXX_COMPILER_ID:Clang>,$<BOOL:${TILTRIM_UNITY}>>>:-Wshadow>
    "$<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized;-Wno-restrict;-Wno-stringop-overflow>"
    $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=${heap}>
    -ffp-contract=off -fno-semantic-interposition)
  # What reads files: the fuzzer sees which of its branches an input takes.
  if(TILTRIM_FUZZ AND target MATCHES "_(runtime|model|sweep|study|cli|commands)$")
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
endfunction()

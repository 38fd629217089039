# By clang 14 the kernel for AVX-512 gives wrong eigenvalues: libstdc++'s masks are g++'s.
string(COMPARE EQUAL "${CMAKE_CXX_COMPILER_ID}" GNU x86_kernels)
option(TILTRIM_X86_KERNELS "On x86-64, kernels for AVX2 and AVX-512 too; without, what other architectures have" ${x86_kernels})

# tiltrim_lanes(<folder> <source>...): compiles the sources of a module once for each instruction
# set, each a version kernel<InstructionSet>; the module selects by runtime/instruction_set.hpp.
function(tiltrim_lanes folder)
  cmake_path(GET folder FILENAME module)
  list(TRANSFORM ARGN PREPEND ${folder}/ OUTPUT_VARIABLE sources)
  set(sets scalar baseline)
  if(TILTRIM_X86_KERNELS AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND sets avx2 avx512)
    set(x86 TILTRIM_X86)
    target_compile_definitions(tiltrim_${module} PRIVATE ${x86})
    target_compile_definitions(tiltrim_runtime PRIVATE ${x86})
  endif()
  set(flags_avx2 -mavx2 -mfma)
  # g++ 12 takes its own headers' "undefined" registers for a mistake.
  set(flags_avx512 -mavx512f -mavx512dq -mavx512vl -mavx512bw -mavx2 -mfma -mprefer-vector-width=512
      -Wno-uninitialized)
  foreach(set IN LISTS sets)
    add_library(tiltrim_${module}_${set} OBJECT ${sources})
    target_compile_features(tiltrim_${module}_${set} PRIVATE cxx_std_20)
    target_compile_definitions(tiltrim_${module}_${set} PRIVATE TILTRIM_SET=${set} TILTRIM_LANES=lanes_${set} ${x86})
    if(set STREQUAL scalar)
      target_compile_definitions(tiltrim_${module}_${set} PRIVATE TILTRIM_LANES_SCALAR)
      set(level 1)  # runs only where it is asked for
    else()
      set(level 3)
    endif()
    target_include_directories(tiltrim_${module}_${set} PRIVATE ${PROJECT_SOURCE_DIR})
    target_link_libraries(tiltrim_${module}_${set} PRIVATE Eigen3::Eigen)
    tiltrim_compile_options(tiltrim_${module}_${set})
    target_compile_options(tiltrim_${module}_${set} PRIVATE ${flags_${set}} $<$<CONFIG:Release>:-O${level}>)
    if(TILTRIM_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      tiltrim_precompiled(tiltrim_${module}_${set} ${set} <experimental/simd>)
    endif()
    # clang need not unroll all that g++ does.
    target_compile_options(tiltrim_${module}_${set} PRIVATE $<$<CXX_COMPILER_ID:Clang>:-Wno-pass-failed>)
    # One source, four times: sanitizers look at two of them, the others take them minutes.
    if(set MATCHES avx)
      target_compile_options(tiltrim_${module}_${set} PRIVATE -fno-sanitize=all)
    endif()
    target_sources(tiltrim_${module} PRIVATE $<TARGET_OBJECTS:tiltrim_${module}_${set}>)
  endforeach()
endfunction()

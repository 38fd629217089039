# The prover with faults, which its tests must find. TILTRIM_MUTANT in the environment chooses one.
set(mutants ${CMAKE_CURRENT_BINARY_DIR}/mutants)
set(mutated model/interval.hpp prove/determinant.cpp prove/prove.cpp prove/roots.cpp prove/tube.cpp)
list(TRANSFORM mutated PREPEND ${PROJECT_SOURCE_DIR}/ OUTPUT_VARIABLE originals)
list(TRANSFORM mutated PREPEND ${mutants}/)
add_custom_command(
  OUTPUT ${mutated}
  COMMAND /usr/bin/python3 ${CMAKE_CURRENT_SOURCE_DIR}/mutants.py ${PROJECT_SOURCE_DIR} ${mutants}
  DEPENDS mutants.py ${originals}
  VERBATIM)
add_library(prove_mutants STATIC ${mutated} ${PROJECT_SOURCE_DIR}/prove/absent.cpp
            ${PROJECT_SOURCE_DIR}/prove/examined.cpp ${PROJECT_SOURCE_DIR}/prove/setup.cpp)
target_include_directories(prove_mutants BEFORE PUBLIC ${mutants})
target_include_directories(prove_mutants PUBLIC ${PROJECT_SOURCE_DIR})
target_link_libraries(prove_mutants PUBLIC tiltrim::model tiltrim::dense tiltrim::runtime fmt::fmt)
set_target_properties(prove_mutants PROPERTIES UNITY_BUILD ${TILTRIM_UNITY} UNITY_BUILD_BATCH_SIZE 2)
tiltrim_test_options(prove_mutants TRUE)

add_executable(prove_mutants_tests prove_planted_test.cpp prove_tube_test.cpp)
target_link_libraries(prove_mutants_tests PRIVATE prove_mutants test_support tiltrim::linearize)
target_precompile_headers(prove_mutants_tests REUSE_FROM test_support)
tiltrim_test_options(prove_mutants_tests TRUE)

# prove_mutant(<fault> <case that finds it> <what that says> [<share of the trials>])
function(prove_mutant fault case words)
  set(trials 0.3 ${ARGN})
  list(GET trials -1 trials)
  set(until "")
  if(words MATCHES "fault.empty")  # the first problem that is certified away is enough
    set(until --abort-after=1)
  endif()
  add_test(NAME prove_mutant_${fault} COMMAND prove_mutants_tests --test-case=${case}* ${until})
  set_tests_properties(prove_mutant_${fault} PROPERTIES ENVIRONMENT "TILTRIM_MUTANT=${fault};TILTRIM_TRIALS=${trials}"
                       PASS_REGULAR_EXPRESSION "${words}")
endfunction()
prove_mutant(none "" "Status: SUCCESS")
prove_mutant(nearest "ranges contain" "REQUIRE. holds.Interval")
foreach(fault no_remainder no_curvature zero_skipped no_upper_limit)
  prove_mutant(${fault} "what is planted in a box" "fault.empty.*proved (stable|unstable)")
endforeach()
prove_mutant(one_side "what is planted in a box" "fault.empty.*proved (stable|unstable)" 1)
foreach(fault no_third no_fourth no_mixed no_cross)
  prove_mutant(${fault} "an instability by terms" "fault.empty.*proved stable")
endforeach()
prove_mutant(all_damped "a damping ratio" "upper < last")
prove_mutant(no_ray "a damping ratio" "upper < last")
prove_mutant(not_strict "the image of an accepted tube" "largest <= 0.9")

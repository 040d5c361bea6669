# One test: configure a preset in a folder of its own, build the offload tests, run them; the host
# backend of that build must give the bits of the build under test.
#   cmake -D SOURCE=... -D BUILD=... -D HOST=... -D REASON=... -P preset.cmake   with PRESET in the
#   environment
# HOST: test_offload of the build under test. REASON: why the preset cannot be used here; empty where
# it can.

set(preset $ENV{PRESET})
if(REASON)
  message("preset skipped: ${REASON}")
  return()
endif()

function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${SOURCE} RESULT_VARIABLE failed
    OUTPUT_VARIABLE output ERROR_VARIABLE output)
  message("${output}")
  set(output "${output}" PARENT_SCOPE)
  if(failed)
    message(FATAL_ERROR "${preset}: failed: ${ARGN}")
  endif()
endfunction()

run(${CMAKE_COMMAND} --preset ${preset} -B ${BUILD})
run(${CMAKE_COMMAND} --build ${BUILD} --target test_offload test_transfers)
if(preset STREQUAL fake-device)
  set(ENV{NMM_EXPECT_DEVICE} 1)
endif()
run(${CMAKE_CTEST_COMMAND} --test-dir ${BUILD} -R "^test_offload$|^test_transfers$" --verbose
  --no-tests=error)

# A target in the build changes nothing for the host.
function(find_bits result)
  if(NOT output MATCHES "solutions on the host: ([0-9a-f]+)")
    message(FATAL_ERROR "test_offload does not say what the host's solutions are")
  endif()
  set(${result} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()
find_bits(theirs)
run(${HOST})
find_bits(ours)
message("host: ${ours} here, ${theirs} in a build for ${preset}")
if(NOT ours STREQUAL theirs)
  message(FATAL_ERROR "the host backend gives other bits in a build for ${preset}")
endif()

# Every kernel of the text must be in the code for the device: those for both precisions, those of
# one precision, the question to the device; and for one team the batches, and `attach`.
function(count_lines result file regex)
  file(STRINGS ${file} line REGEX "${regex}")
  list(LENGTH line n)
  if(n EQUAL 0)
    message(FATAL_ERROR "${file}: nothing found")
  endif()
  set(${result} ${n} PARENT_SCOPE)
endfunction()
if(preset STREQUAL nvptx)
  set(text ${SOURCE}/src/solve/jacobi)
  set(loop "^ *(PARALLEL_FOR|SINGLE {)$")
  set(batch "^ *BATCH {$")
  count_lines(both ${text}_kernels.inl "${loop}")
  count_lines(scalar ${text}_scalars.inl "${loop}")
  count_lines(single ${text}_methods.inl "${loop}")
  count_lines(batch_both ${text}_kernels.inl "${batch}")
  count_lines(batch_single ${text}_methods.inl "${batch}")
  math(EXPR launches "2 * ${both} + ${scalar} + ${single} + 1")
  math(EXPR team "2 * ${batch_both} + ${batch_single} + 1")
  math(EXPR expected "${launches} + ${team}")
  count_lines(found ${BUILD}/tests/offload/test_offload "visible .entry .*_omp_fn")
  message("kernels: ${launches} by launches and ${team} by one team in the text, ${found} for the device")
  if(NOT found EQUAL expected)
    message(FATAL_ERROR "the text has ${expected} kernels, the code for the device ${found}")
  endif()
endif()

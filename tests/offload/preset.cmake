# One test: configure a preset in a folder of its own, build the offload tests, run them.
#   cmake -D SOURCE=... -D BUILD=... -D REASON=... -P preset.cmake   with PRESET in the environment
# REASON: why the preset cannot be used here; empty where it can.

set(preset $ENV{PRESET})
if(REASON)
  message("preset skipped: ${REASON}")
  return()
endif()

function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${SOURCE} RESULT_VARIABLE failed
    OUTPUT_VARIABLE output ERROR_VARIABLE output)
  message("${output}")
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

# Every kernel of the text, and the question to the device, must be in the code for the device.
if(preset STREQUAL nvptx)
  file(STRINGS ${SOURCE}/src/solve/jacobi_kernels.inl kernel REGEX "^ *(PARALLEL_FOR|SINGLE {)$")
  file(STRINGS ${BUILD}/tests/offload/test_offload entry REGEX "visible .entry .*_omp_fn")
  list(LENGTH kernel n_kernel)
  list(LENGTH entry n_entry)
  math(EXPR n_expected "${n_kernel} + 1")
  message("kernels: ${n_expected} in the text, ${n_entry} for the device")
  if(NOT n_entry EQUAL n_expected OR n_kernel EQUAL 0)
    message(FATAL_ERROR "a kernel is missing in the code for the device")
  endif()
endif()

# SPDX-License-Identifier: MIT
#
# Is there a compiler that can treat the processor as a device? Asked once, by a program that looks.
if(NOT DEFINED NMM_FAKE_DEVICE)
  set(trial ${PROJECT_BINARY_DIR}/tests/offload/trial)
  file(MAKE_DIRECTORY ${trial})
  set(reason "clang-14 is not installed")
  find_program(NMM_CLANG clang-14)
  if(NMM_CLANG)
    execute_process(
      COMMAND ${NMM_CLANG} -fopenmp -fopenmp-targets=x86_64-pc-linux-gnu
              ${CMAKE_CURRENT_LIST_DIR}/trial.c -o ${trial}/trial
      RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET)
    if(failed)
      set(reason "clang-14 cannot build for x86_64 as a target (libomp-14-dev, clang-tools-14)")
    else()
      execute_process(COMMAND ${trial}/trial RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET)
      set(reason "target regions of clang-14 run on the host (no x86_64 plugin)")
    endif()
    if(NOT failed)
      set(reason "")
    endif()
  endif()
  set(NMM_FAKE_DEVICE "${reason}" CACHE INTERNAL "Why the fake device cannot be used; empty: it can")
endif()

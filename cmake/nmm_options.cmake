# Flags that every floor shares: one interface target, `nmm_options`.
#
# -ffp-contract=off everywhere: the same scene gives the same bits (docs/design.md).

add_library(nmm_options INTERFACE)
target_compile_options(nmm_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Wvla
  -ffp-contract=off -fno-math-errno
  $<$<BOOL:${NMM_WERROR}>:-Werror>)
target_compile_definitions(nmm_options INTERFACE
  $<$<BOOL:${NMM_VALIDATE}>:NMM_VALIDATE_ON>
  $<$<CONFIG:Debug>:NMM_DEBUG>)

# A plain -fopenmp silently becomes an offload build where gcc's nvptx package is installed, hence
# -foffload=disable at compile and link.
if(NMM_TARGET_FLAGS)
  separate_arguments(nmm_target_flags UNIX_COMMAND "${NMM_TARGET_FLAGS}")
endif()
# The floor `offload` in a build with and without a target backend.
set(nmm_offload_source no_target.c)
if(NMM_TARGET_FLAGS)
  set(nmm_offload_source jacobi_target.c jacobi_team.c)
endif()
set(nmm_openmp -fopenmp)
if(CMAKE_C_COMPILER_ID STREQUAL "GNU" AND NOT NMM_TARGET_FLAGS)
  list(APPEND nmm_openmp -foffload=disable)
endif()
target_compile_options(nmm_options INTERFACE ${nmm_openmp} ${nmm_target_flags})
target_link_options(nmm_options INTERFACE ${nmm_openmp} ${nmm_target_flags})
if(NMM_SANITIZE)
  target_compile_options(nmm_options INTERFACE -fsanitize=${NMM_SANITIZE} -fno-omit-frame-pointer
    -fno-sanitize-recover=all)
  target_link_options(nmm_options INTERFACE -fsanitize=${NMM_SANITIZE})
endif()
target_link_libraries(nmm_options INTERFACE m)

# nmm_floor(NAME SOURCES a.c b.c USES floors... LINKS libraries... [DIRECTORY dir])
# One floor of the program: an object library whose headers are visible only to floors that use it.
function(nmm_floor name)
  cmake_parse_arguments(FLOOR "" "DIRECTORY" "SOURCES;USES;LINKS" ${ARGN})
  if(NOT FLOOR_DIRECTORY)
    set(FLOOR_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/${name})
  endif()
  list(TRANSFORM FLOOR_SOURCES PREPEND ${FLOOR_DIRECTORY}/)
  add_library(nmm_${name} OBJECT ${FLOOR_SOURCES})
  target_include_directories(nmm_${name} PUBLIC ${FLOOR_DIRECTORY} ${PROJECT_SOURCE_DIR}/include)
  target_compile_definitions(nmm_${name} PRIVATE NMM_BUILDING)
  target_link_libraries(nmm_${name} PUBLIC nmm_options PRIVATE ${FLOOR_LINKS})
  foreach(used IN LISTS FLOOR_USES)
    # Headers only: the objects are gathered once, in the library.
    target_include_directories(nmm_${name} PUBLIC
      $<TARGET_PROPERTY:nmm_${used},INTERFACE_INCLUDE_DIRECTORIES>)
  endforeach()
  set_target_properties(nmm_${name} PROPERTIES NMM_LINKS "${FLOOR_LINKS}")
  set_property(GLOBAL APPEND PROPERTY NMM_FLOORS nmm_${name})
  set_property(GLOBAL APPEND PROPERTY NMM_FLOOR_LINKS ${FLOOR_LINKS})
endfunction()

# The direct solver: an optional part, by CHOLMOD of SuiteSparse with 64-bit indices.
#
# NMM_DIRECT: AUTO where the library is found; ON: required; OFF: left out. Gives the sources and
# the link of the floor `solve`. CHOLMOD is LGPL and GPL, see docs/contributing.md.

set(NMM_DIRECT AUTO CACHE STRING "Direct solver by SuiteSparse: AUTO, ON, OFF")
set_property(CACHE NMM_DIRECT PROPERTY STRINGS AUTO ON OFF)

set(nmm_direct_source no_direct.c)
set(nmm_direct_link)
if(NMM_DIRECT)
  find_path(NMM_CHOLMOD_INCLUDE cholmod.h PATH_SUFFIXES suitesparse)
  find_library(NMM_CHOLMOD_LIBRARY cholmod)
  mark_as_advanced(NMM_CHOLMOD_INCLUDE NMM_CHOLMOD_LIBRARY)
  if(NMM_CHOLMOD_INCLUDE AND NMM_CHOLMOD_LIBRARY)
    set(nmm_direct_source direct.c)
    set(nmm_direct_link nmm_cholmod)
    add_library(nmm_cholmod INTERFACE IMPORTED GLOBAL)
    target_include_directories(nmm_cholmod SYSTEM INTERFACE ${NMM_CHOLMOD_INCLUDE})
    target_link_libraries(nmm_cholmod INTERFACE ${NMM_CHOLMOD_LIBRARY})
    message(STATUS "Direct solver: CHOLMOD, ${NMM_CHOLMOD_LIBRARY}")
  elseif(NMM_DIRECT STREQUAL "AUTO")
    message(STATUS "Direct solver: left out, SuiteSparse is not there (libsuitesparse-dev)")
  else()
    message(FATAL_ERROR "NMM_DIRECT is on, but SuiteSparse is not there (libsuitesparse-dev)")
  endif()
else()
  message(STATUS "Direct solver: left out, NMM_DIRECT is off")
endif()

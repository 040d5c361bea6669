// SPDX-License-Identifier: MIT
//
// Version and build, as one line: `nmm --version` prints it and every run file carries it.
// NMM_VERSION and NMM_BUILD come from the build (src/CMakeLists.txt).

#include "base.h"

#ifdef __clang__
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

const char *nmm_version(void) {
    return "nmm " NMM_VERSION " (" COMPILER ", " NMM_BUILD ")";
}

// SPDX-License-Identifier: MIT
//
// Version and build, as one line: `nmm --version` prints it and every run file carries it.
// NMM_VERSION and NMM_BUILD come from the build (src/CMakeLists.txt).

#include "base.h"

#define TEXT_OF(x) #x
#define DOTTED(a, b, c) TEXT_OF(a) "." TEXT_OF(b) "." TEXT_OF(c)
#ifdef __clang__
#define COMPILER "clang " DOTTED(__clang_major__, __clang_minor__, __clang_patchlevel__)
#else
#define COMPILER "gcc " __VERSION__
#endif

const char *nmm_version(void) {
    return "nmm " NMM_VERSION " (" COMPILER ", " NMM_BUILD ")";
}

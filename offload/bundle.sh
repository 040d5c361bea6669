#!/bin/sh
# SPDX-License-Identifier: MIT
#
# Build nmm for an NVIDIA GPU and pack it with the libraries it needs, to be carried to a machine
# that has the GPU and nothing else:
#
#     sh offload/bundle.sh gcc BUILD       gcc 12 with gcc-12-offload-nvptx
#     sh offload/bundle.sh clang BUILD     clang 16; the equal bits of docs/offload.md
#
# BUILD: a folder for the build; BUILD/nmm-gpu.tar.xz is the result. For clang, in the environment:
#     CLANG   the compiler (clang-16)
#     LLVM    its tree, with lib/libomptarget.so (/usr/lib/llvm-16)
#     CUDA    CUDA's compiler tools, of which ptxas and libdevice are used (/usr/local/cuda)
#     ARCH    sm_80, sm_90, ... (sm_90)
# There: tar xf nmm-gpu.tar.xz && sh nmm-gpu/check.sh; its exit status is 5 where no device was used.

set -eu
[ $# = 2 ] || { sed -n '3,17s/^# \{0,1\}//p' "$0" >&2; exit 2; }
source=$(cd "$(dirname "$0")/.." && pwd)
mkdir -p "$2"
build=$(cd "$2" && pwd)
bundle=$build/nmm-gpu
arch=${ARCH:-sm_90}
llvm=${LLVM:-/usr/lib/llvm-16}

# --- Build

# DT_RPATH, not DT_RUNPATH: it also holds for what the runtime opens.
link=-Wl,--disable-new-dtags
case $1 in
gcc)
    compiler=gcc-12
    flags="-foffload=nvptx-none '-foffload-options=nvptx-none=-O3 -lm -latomic -Wa,--no-verify' -no-pie"
    ;;
clang)
    compiler=${CLANG:-clang-16}
    flags="--offload-arch=$arch --cuda-path=${CUDA:-/usr/local/cuda} -Wno-unknown-cuda-version"
    link="$link -L$llvm/lib -Wl,-rpath-link,$llvm/lib"
    export LD_LIBRARY_PATH="$llvm/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
    ;;
*)
    echo "bundle.sh: gcc or clang, not $1" >&2
    exit 2
    ;;
esac
# shellcheck disable=SC2016 # $ORIGIN is for the loader
cmake -S "$source" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_C_COMPILER="$compiler" -DNMM_TARGET_FLAGS="$flags" \
    -DCMAKE_EXE_LINKER_FLAGS="$link" -DCMAKE_SHARED_LINKER_FLAGS="$link" \
    -DCMAKE_BUILD_WITH_INSTALL_RPATH=ON -DCMAKE_INSTALL_RPATH='$ORIGIN/../lib' -DNMM_BUILD_TESTS=ON
cmake --build "$build" --target nmm test_offload bench_solve

# --- Pack

# Copy a file into a folder of the bundle, and the libraries it needs but those of the C library,
# which belong to the machine.
pack() {
    cp -L "$1" "$bundle/$2/"
    if ldd "$1" | grep "not found" >&2; then
        echo "bundle.sh: $1 needs these; LD_LIBRARY_PATH may say where they are" >&2
        exit 4
    fi
    ldd "$1" | awk '$2 == "=>" && $3 ~ /^\// {print $3}' | while read -r library; do
        case ${library##*/} in
        libc.so.* | libm.so.* | libdl.so.* | librt.so.* | libpthread.so.* | libresolv.so.*) ;;
        *) [ -e "$bundle/lib/${library##*/}" ] || cp -L "$library" "$bundle/lib/" ;;
        esac
    done
}

rm -rf "$bundle"
mkdir -p "$bundle/bin" "$bundle/lib" "$bundle/scenes"
library=$(find "$build" -name libnmm.so)
LD_LIBRARY_PATH=${library%/*}:${LD_LIBRARY_PATH:-}
export LD_LIBRARY_PATH
for program in nmm tests/offload/test_offload tests/solve/bench_solve; do
    pack "$build/$program" bin
done
# What the runtime opens by name only.
if [ "$1" = gcc ]; then
    pack "$(gcc-12 -print-file-name=libgomp-plugin-nvptx.so.1)" lib
else
    for library in "$llvm"/lib/libomptarget.rtl.cuda*.so*; do
        pack "$library" lib
    done
fi
for scene in strut slope; do
    cp "$source/examples/$scene/scene.yaml" "$bundle/scenes/$scene.yaml"
done
cp "$source/offload/check.sh" "$bundle/check.sh"
version=$("$compiler" --version | head -n 1)
cat >"$bundle/README" <<END
nmm for an NVIDIA GPU, built by $version; needs its driver (libcuda.so.1) and the C library of Debian 12 or later.
sh check.sh compares the GPU with the host, bit by bit and by time; exit status 0: equal, 1: answers differ, 3: only last bits do, 5: no device was used.
Then: bin/nmm run scenes/slope.yaml --device target; bin/nmm compare scenes/slope.yaml --steps 20 --json.
END
tar -C "$build" -cJf "$build/nmm-gpu.tar.xz" nmm-gpu
echo "$build/nmm-gpu.tar.xz: $(du -h "$build/nmm-gpu.tar.xz" | cut -f 1)"

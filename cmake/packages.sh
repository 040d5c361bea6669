# SPDX-License-Identifier: MIT
#
# Debian packages that the project needs, and how to make sure of them. Read by other scripts:
#     . cmake/packages.sh; need_packages $packages_build
# Asks apt-get only for what is missing, so that it works without a network once all is there.

packages_build="build-essential cmake ninja-build pkg-config libhdf5-dev libyaml-dev
    libcairo2-dev libpng-dev fonts-dejavu-core"

packages_test="libcmocka-dev python3 python3-h5py python3-vtk9 python3-jsonschema python3-yaml
    clang-14 clang-tools-14 libclang-rt-14-dev llvm-14 libomp-14-dev clang-format-14 clang-tidy-14
    gcc-12-offload-nvptx valgrind"

# Solvers to measure ours against, and a fast BLAS for those that use one (docs/solvers.md).
packages_bench="libcmocka-dev libpetsc-real-dev libeigen3-dev libsuitesparse-dev
    libopenblas0-pthread python3 python3-matplotlib"

# True where the package is installed.
has_package() {
    dpkg-query -W -f '${Status}\n' "$1" 2>/dev/null | grep -q '^install ok installed$'
}

# need_packages NAME...: install those that are missing, or say how and fail.
need_packages() {
    if ! command -v dpkg-query >/dev/null; then
        echo "note: not a Debian system; these packages are taken for granted:" "$@" >&2
        return 0
    fi
    missing=
    for package in "$@"; do
        has_package "$package" || missing="$missing $package"
    done
    [ -z "$missing" ] && return 0
    if [ "$(id -u)" = 0 ]; then
        as_root=
    elif command -v sudo >/dev/null; then
        as_root="sudo"
    else
        echo "error: packages are missing; install them as root with:" >&2
        echo "    apt-get install --no-install-recommends$missing" >&2
        return 4
    fi
    echo "installing:$missing"
    $as_root apt-get update -qq &&
        $as_root env DEBIAN_FRONTEND=noninteractive \
            apt-get install -qq -y -o Dpkg::Use-Pty=0 --no-install-recommends $missing >/dev/null
}

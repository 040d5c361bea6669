#!/bin/sh
# SPDX-License-Identifier: MIT
#
# In a bundle made by bundle.sh: does this machine's GPU give the answers of its host? All ways of
# solving, bit by bit, then whole scenes. Exit status 0: equal; 1: the answers of a scene differ;
# 3: the scenes agree, but not every solve in every bit; 5: no device was used.

cd "$(dirname "$0")" || exit 2

# The driver's library: where the loader looks, or in the places of containers. LLVM's runtime asks
# for libcuda.so, which a driver alone does not bring.
driver=$(PATH=$PATH:/sbin:/usr/sbin ldconfig -p 2>/dev/null | awk '/libcuda\.so\.1 / {print $NF; exit}')
for folder in /usr/local/nvidia/lib64 /usr/lib/x86_64-linux-gnu /usr/lib64 /usr/lib/wsl/lib; do
    [ -z "$driver" ] && [ -e "$folder/libcuda.so.1" ] && driver=$folder/libcuda.so.1
done
if [ -z "$driver" ]; then
    echo "no device: libcuda.so.1 is not on this machine"
else
    echo "driver: $driver"
    links=$(mktemp -d) || exit 2
    trap 'rm -rf "$links"' EXIT
    ln -s "$driver" "$links/libcuda.so"
    ln -s "$driver" "$links/libcuda.so.1"
    LD_LIBRARY_PATH=$links:$(dirname "$driver")${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    export LD_LIBRARY_PATH
    NMM_EXPECT_DEVICE=1
    export NMM_EXPECT_DEVICE
fi

bin/nmm compare scenes/strut.yaml --steps 2
status=$?
case $status in
0 | 1) ;;
5)
    echo "no device was used"
    exit 5
    ;;
*)
    echo "nmm does not run: exit status $status"
    exit $status
    ;;
esac

bits=equal
agree=yes
[ $status = 0 ] || agree=no
bin/test_offload || bits=different
compare() {
    bin/nmm compare scenes/slope.yaml "$@" || agree=no
}
compare --steps 10
for method in pcg chebyshev; do
    for precision in double mixed; do
        compare --steps 2 --set solver.method=$method --set solver.precision=$precision
    done
done

echo "scenes agree: $agree; bits of the single solves: $bits"
[ $agree = yes ] || exit 1
[ $bits = equal ] || exit 3

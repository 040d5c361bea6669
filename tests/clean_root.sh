#!/bin/sh
# SPDX-License-Identifier: MIT
#
# Do the two documented commands work on a bare Debian 12? Makes a minimal root with debootstrap,
# puts the committed source there, runs both commands, installs nmm, takes source and build away and
# uses what was installed. Needs root, debootstrap and a Debian mirror; takes some twenty minutes.
#
# Usage: sh tests/clean_root.sh FOLDER MIRROR [APT_FOLDER]
#     FOLDER      a new folder for the root; left there, so that one can look
#     MIRROR      for debootstrap, such as http://deb.debian.org/debian
#     APT_FOLDER  copied over /etc/apt of the root, for a proxy and the like

set -eu
root=$1 mirror=$2 apt=${3:-}
source=$(cd "$(dirname "$0")/.." && pwd)

say() {
    echo "== $(date +%T) $*"
}

inside() {
    chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 \
        sh -ec "$1"
}

say "a bare root"
mkdir "$root"
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$root.log" 2>&1
[ -z "$apt" ] || cp -rL "$apt/." "$root/etc/apt/"
[ ! -e /etc/resolv.conf ] || cp -L /etc/resolv.conf "$root/etc/resolv.conf"
mount -t proc proc "$root/proc" || echo "no /proc inside; going on without"
mount -t devpts devpts "$root/dev/pts" || echo "no terminals inside; going on without"
trap 'umount "$root/proc" "$root/dev/pts" 2>/dev/null || true' EXIT

mkdir "$root/nmm"
git -C "$source" archive HEAD | tar -x -C "$root/nmm"

say "the first command: a picture"
inside "cd /nmm && sh examples/first_picture.sh /root"
inside "test -s /root/slope.vtkhdf && test -s /root/slope.png"

say "installed, without source and build"
inside "cd /nmm && cmake --install build/release >/dev/null && ldconfig"
inside "cp -r /nmm/tests/cli/consumer /root/ && mv /nmm /nmm.away"
inside "cd /root && nmm --version && nmm info slope.vtkhdf >/dev/null"
inside "cd /root && cmake -S consumer -B build >/dev/null && cmake --build build >/dev/null &&
    build/consumer consumer/fall.yaml"
inside "cd /root && cc consumer/consumer.c -o other \$(pkg-config --cflags --libs nmm) &&
    ./other consumer/fall.yaml"
inside "mv /nmm.away /nmm"

say "the second command: all tests"
inside "cd /nmm && sh tests/all.sh"
say "done"

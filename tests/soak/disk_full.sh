#!/bin/bash
# Runs a job on a disk that is too small: it must stop with a clear message and a valid folder, and go on when there is
# room. Needs to be root (a tmpfs is mounted).
# Usage: tests/soak/disk_full.sh RECIPE
set -eu
recipe=$1
petcomp=${PETCOMP:-target/release/petcomp}
[ "$(id -u)" = 0 ] || { echo "skipped: only root may mount a small disk"; exit 0; }
disk=$(mktemp -d)
mount -t tmpfs -o size=3m tmpfs "$disk" || { echo "skipped: no disk can be mounted here"; rmdir "$disk"; exit 0; }
trap 'umount "$disk"; rmdir "$disk"' EXIT
make() { "$petcomp" -q dataset generate "$recipe" -n 60 --set 'scene.image=[128,96]' -o "$disk/out"; }
if make 2> "$disk.log"; then echo "expected the disk to be full"; exit 1; else status=$?; fi
cat "$disk.log"
grep -qi "no space left" "$disk.log"
[ "$status" = 4 ]
rm -f "$disk.log"
find "$disk/out" -name '*.tmp' | grep . && { echo "temporary files are left"; exit 1; }
mount -o remount,size=100m "$disk"
make
"$petcomp" -q dataset check "$disk/out"
echo "stopped on a full disk with status $status, went on with room, and the folder is good"

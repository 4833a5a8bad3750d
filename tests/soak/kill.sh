#!/bin/bash
# Kills a job at random moments again and again; what it has made in the end must equal an unbroken run, file by file.
# Usage: tests/soak/kill.sh RECIPE [KILLS] [IMAGES]
#   RECIPE  a recipe with its folders, e.g. that of `petcomp demo`
#   KILLS   how often (200); a job that ends before its next kill is begun anew, so every kill hits a running job
#   IMAGES  of a job (300), made small
set -eu
recipe=$1 kills=${2:-200} images=${3:-300}
petcomp=${PETCOMP:-target/release/petcomp}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
make() { "$petcomp" -q dataset generate "$recipe" -n "$images" --seed 11 --set 'scene.image=[128,96]' -o "$1"; }
same() { diff -r --exclude='.*' "$work/whole" "$1" > "$work/diff" || { head "$work/diff"; echo "differs after $killed kills"; exit 1; }; }

start=$(date +%s%N)
make "$work/whole"
whole_ms=$((($(date +%s%N) - start) / 1000000))
echo "unbroken run: $images images in $whole_ms ms"
killed=0 jobs=0
while [ "$killed" -lt "$kills" ]; do
  jobs=$((jobs + 1)) folder=$work/job
  rm -rf "$folder"
  while [ "$killed" -lt "$kills" ]; do
    make "$folder" 2> /dev/null & pid=$!
    # A random moment of a sixth of the unbroken run, so that each job takes several kills.
    sleep "$(awk -v s="$RANDOM" -v m="$whole_ms" 'BEGIN { printf "%.3f", s / 32768 * m / 6000 }')"
    if kill -9 "$pid" 2> /dev/null; then killed=$((killed + 1)); fi
    if wait "$pid" 2> /dev/null; then break; fi
  done
  "$petcomp" -q dataset generate "$recipe" -n "$images" --seed 11 --set 'scene.image=[128,96]' -o "$folder" --resume
  same "$folder"
  echo "job $jobs: equal after $killed kills in all"
done
echo "$killed kills, $jobs jobs: every folder equals the unbroken run"

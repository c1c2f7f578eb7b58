#!/bin/sh
# build.sh OUTPUT [--static]: the compiler and pkg-config alone.
set -eu
here=$(dirname "$0")
flags=$("${PKG_CONFIG:-pkg-config}" ${2:-} --cflags --libs nacre)
# shellcheck disable=SC2086 # the flags are words
"${CXX:-c++}" -std=c++17 -O1 "$here/../main.cpp" -o "$1" $flags

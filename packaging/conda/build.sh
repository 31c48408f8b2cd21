#!/bin/sh
# Called by conda-build in the sources, with the places of what is there and of what is made in variables.
set -e
cmake -S . -B build-conda -G Ninja $CMAKE_ARGS -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$PREFIX" \
  -DCMAKE_INSTALL_LIBDIR=lib -DCMAKE_PREFIX_PATH="$PREFIX" \
  -DTESSERA_TESTS=OFF -DTESSERA_BENCH=OFF -DTESSERA_SAMPLES=OFF -DTESSERA_PYTHON=OFF
cmake --build build-conda --parallel "${CPU_COUNT:-1}"
cmake --install build-conda

# Functions that install packages, build presets and make geometry, sourced by tools/demo, tools/check and tools/figures.
# Supports Debian 12 and Ubuntu 22.04 or newer.
# shellcheck shell=bash

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
build="$root/build/release"

# openimageio-tools and libgmock-dev contain files that the CMake configurations of libopenimageio-dev and libgtest-dev
# require. openexr contains exrheader, which a test runs.
packages=(
    g++ cmake ninja-build git clang-format
    libembree-dev libtbb-dev libimath-dev libopenexr-dev libopenimageio-dev openimageio-tools libopencolorio-dev
    libosd-dev libtinygltf-dev libcli11-dev libspdlog-dev libfmt-dev nlohmann-json3-dev zlib1g-dev
    libgtest-dev libgmock-dev libbenchmark-dev
    openexr python3 python3-numpy python3-openimageio
)

# Runs a command as root.
as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        echo "error: installing packages needs root or sudo; missing packages: ${missing[*]}" >&2
        return 1
    fi
}

# Installs missing packages. Does not run apt if none is missing.
install_packages() {
    if ! command -v dpkg-query >/dev/null; then
        echo "note: dpkg is missing; install the equivalents of these Debian packages: ${packages[*]}" >&2
        return
    fi
    local package
    missing=()
    for package in "${packages[@]}"; do
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)" = installed ] ||
            missing+=("$package")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    echo "installing: ${missing[*]}"
    as_root env DEBIAN_FRONTEND=noninteractive apt-get update -qq </dev/null
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" </dev/null
}

# Configures and builds a preset in build/PRESET: build_preset PRESET [TARGET...]
build_preset() {
    local preset=$1 launcher=() target=()
    shift
    [ $# -eq 0 ] || target=(--target "$@")
    if command -v ccache >/dev/null; then
        launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON)
    fi
    mkdir -p -- "$root/build/$preset"
    (cd -- "$root" && cmake --preset "$preset" ${launcher[@]+"${launcher[@]}"} >"$root/build/$preset/configure.log") || {
        cat -- "$root/build/$preset/configure.log"
        return 1
    }
    (cd -- "$root" && cmake --build --preset "$preset" ${target[@]+"${target[@]}"})
}

# Builds the release preset: build_release [TARGET...]
build_release() {
    build_preset release "$@"
}

# Makes the geometry and images of the scenes if they are missing or outdated.
make_geometry() {
    /usr/bin/python3 "$root/tools/make-geometry" --if-missing
}

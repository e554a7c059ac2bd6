// What options take that are numbers: for CLI::Option::transform, with messages that say it in words.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <limits>

namespace strobe {

/// "takes a number": one that a T holds.
template <class T>
CLI::Validator finiteNumber();
/// "takes a number above 0": one that a T holds, and does not make 0.
template <class T>
CLI::Validator numberAboveZero();
/// "takes an integer of at least …", or of at most …, whichever it misses. Zeros may lead (CLI11 would read
/// octal digits), and 0x.
CLI::Validator integerBetween(uint64_t least, uint64_t most);
/// "takes a size such as 4G or 800M, at least …": makes it a number of bytes, K, M, G and T being powers of
/// 1024. `least`: whole megabytes.
CLI::Validator byteSize(uint64_t least);

/// As integerBetween, up to what a T holds.
template <class T>
CLI::Validator integerFrom(uint64_t least) {
    return integerBetween(least, uint64_t(std::numeric_limits<T>::max()));
}

} // namespace strobe

// Validators of numbers, for CLI::Option::transform.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <limits>

namespace strobe {

/// Rejects values that are not finite numbers of type T: "takes a number".
template <class T>
CLI::Validator finiteNumber();
/// Rejects values that are not finite numbers of type T above 0: "takes a number above 0".
template <class T>
CLI::Validator numberAboveZero();
/// Rejects values that are not integers in [min, max]: "takes an integer of at least …" or "… of at
/// most …". Accepts hexadecimal numbers with 0x, and decimal numbers with leading zeros, which CLI11 would
/// read as octal.
CLI::Validator integerBetween(uint64_t min, uint64_t max);
/// Converts a size such as 4G or 800M to bytes; K, M, G and T are powers of 1024. Rejects smaller sizes than
/// `min`, a multiple of 1 MiB: "takes a size such as 4G or 800M, at least …".
CLI::Validator byteSize(uint64_t min);

/// integerBetween `min` and the maximum of type T.
template <class T>
CLI::Validator integerFrom(uint64_t min) {
    return integerBetween(min, uint64_t(std::numeric_limits<T>::max()));
}

} // namespace strobe

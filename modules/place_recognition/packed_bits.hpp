#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace km {

/// Writes numbers in few bits. Zeros fill up the last byte.
class BitWriter {
 public:
  /// Writes the lowest `count` bits of `number`, the highest first. `count` is at most 63.
  void bits(std::uint64_t number, unsigned count) {
    while (count-- > 0) {
      if (free_ == 0) {
        bytes_.push_back(0);
        free_ = 8;
      }
      bytes_.back() =
          static_cast<std::uint8_t>(bytes_.back() | (((number >> count) & 1U) << --free_));
    }
  }

  /// Writes the Elias gamma code of a number from 1 to 2^32: one bit for 1, three for 2 and 3, ...
  void gamma(std::uint64_t number) {
    const auto length = static_cast<unsigned>(std::bit_width(number));
    bits(0, length - 1);
    bits(number, length);
  }

  /// Writes the Golomb-Rice code with parameter k: number / 2^k ones, a zero, and the k lowest
  /// bits. The code is short for numbers about 2^k.
  void rice(std::uint64_t number, unsigned k) {
    for (std::uint64_t quotient = number >> k; quotient > 0; --quotient) bits(1, 1);
    bits(0, 1);
    bits(number, k);
  }

  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
  unsigned free_ = 0;  // number of unused bits of the last byte
};

/// Reads untrusted bytes in the format of BitWriter. nullopt if the bytes end too early, or if a
/// gamma code is longer than the writer makes.
class BitReader {
 public:
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  [[nodiscard]] std::optional<std::uint64_t> bits(unsigned count) {
    if (count > left()) return std::nullopt;
    std::uint64_t number = 0;
    while (count-- > 0) {
      number = (number << 1U) | ((bytes_[next_ / 8] >> (7 - next_ % 8)) & 1U);
      ++next_;
    }
    return number;
  }

  [[nodiscard]] std::optional<std::uint64_t> gamma() {
    const auto zeros = run_of(0, 32);
    if (!zeros) return std::nullopt;
    const auto rest = bits(*zeros);
    if (!rest) return std::nullopt;
    return (std::uint64_t{1} << *zeros) | *rest;
  }

  /// Precondition: k is at most 31.
  [[nodiscard]] std::optional<std::uint64_t> rice(unsigned k) {
    const auto quotient = run_of(1, left());
    if (!quotient) return std::nullopt;
    const auto rest = bits(k);
    if (!rest) return std::nullopt;
    return (std::uint64_t{*quotient} << k) | *rest;
  }

  /// True if nothing is left but the zeros that fill up the last byte.
  [[nodiscard]] bool ended() {
    if (left() >= 8) return false;
    return *bits(static_cast<unsigned>(left())) == 0;
  }

 private:
  [[nodiscard]] std::size_t left() const { return 8 * bytes_.size() - next_; }

  // Number of bits equal to `value` before the first other bit, which is read too; nullopt beyond
  // `most`.
  [[nodiscard]] std::optional<unsigned> run_of(std::uint64_t value, std::size_t most) {
    for (unsigned run = 0; run <= most; ++run) {
      const auto bit = bits(1);
      if (!bit) return std::nullopt;
      if (*bit != value) return run;
    }
    return std::nullopt;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t next_ = 0;  // index of the next bit
};

}  // namespace km

#pragma once

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace km {

/// Initial value of an FNV-1a hash.
inline constexpr std::uint64_t kFnv1aBasis = 0xcbf29ce484222325ULL;

/// Mixes `value` into `hash`, byte by byte: FNV-1a (Fowler, Noll, Vo), 64 bits.
inline void mix_fnv1a(std::uint64_t& hash, std::uint64_t value) {
  for (int byte = 0; byte < 8; ++byte) {
    hash ^= (value >> (8 * byte)) & 0xffU;
    hash *= 0x100000001b3ULL;
  }
}

/// Mixes `bytes` into `hash`, eight at a time, the least significant first. Missing bytes of the
/// last eight count as zeros, so the number of bytes must be mixed in too.
inline void mix_fnv1a(std::uint64_t& hash, std::span<const std::uint8_t> bytes) {
  for (std::size_t begin = 0; begin < bytes.size(); begin += 8) {
    const auto eight = bytes.subspan(begin, std::min<std::size_t>(8, bytes.size() - begin));
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < eight.size(); ++k) value |= std::uint64_t{eight[k]} << (8U * k);
    mix_fnv1a(hash, value);
  }
}

/// Writes numbers one after the other, least significant byte first, on any machine.
class ByteWriter {
 public:
  void u8(std::uint8_t value) { bytes_.push_back(value); }
  void u16(std::uint16_t value) { fixed(value); }
  void u32(std::uint32_t value) { fixed(value); }
  void u64(std::uint64_t value) { fixed(value); }
  void f32(float value) { fixed(std::bit_cast<std::uint32_t>(value)); }
  void f64(double value) { fixed(std::bit_cast<std::uint64_t>(value)); }

  /// Seven bits a byte, the lowest first; small numbers take one byte, the largest ten.
  void varint(std::uint64_t value) {
    for (; value >= 0x80U; value >>= 7U) u8(static_cast<std::uint8_t>(value | 0x80U));
    u8(static_cast<std::uint8_t>(value));
  }

  /// Writes the bytes without their number.
  void bytes(std::span<const std::uint8_t> values) {
    bytes_.insert(bytes_.end(), values.begin(), values.end());
  }

  [[nodiscard]] std::size_t size() const { return bytes_.size(); }

  /// Returns the written bytes; the writer is empty afterwards.
  [[nodiscard]] std::vector<std::uint8_t> release() { return std::exchange(bytes_, {}); }

 private:
  template <std::unsigned_integral T>
  void fixed(T value) {
    for (std::size_t k = 0; k < sizeof(T); ++k)
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8U * k)));
  }

  std::vector<std::uint8_t> bytes_;
};

/// Reads the bytes of a ByteWriter without trusting them. A read past the end, or of an impossible
/// value, returns zero and fails the reader permanently. Check done() or failed() once, at the end.
/// The bytes must outlive the reader.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  [[nodiscard]] std::uint8_t u8() { return fixed<std::uint8_t>(); }
  [[nodiscard]] std::uint16_t u16() { return fixed<std::uint16_t>(); }
  [[nodiscard]] std::uint32_t u32() { return fixed<std::uint32_t>(); }
  [[nodiscard]] std::uint64_t u64() { return fixed<std::uint64_t>(); }
  [[nodiscard]] float f32() { return std::bit_cast<float>(fixed<std::uint32_t>()); }
  [[nodiscard]] double f64() { return std::bit_cast<double>(fixed<std::uint64_t>()); }

  /// Fails for a number above `max`, and for one with more bytes than necessary, so that equal
  /// numbers have equal bytes.
  [[nodiscard]] std::uint64_t varint(
      std::uint64_t max = std::numeric_limits<std::uint64_t>::max()) {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64U; shift += 7U) {
      const std::uint8_t byte = u8();
      const bool overflows = shift == 63U && byte > 1U;
      const bool padded = shift > 0U && byte == 0U;
      if (failed_ || overflows || padded) break;
      value |= std::uint64_t{byte & 0x7FU} << shift;
      if (byte < 0x80U) return value <= max ? value : fail();
    }
    return fail();
  }

  /// A varint that must fit into T.
  template <std::unsigned_integral T>
  [[nodiscard]] T varint_as() {
    return static_cast<T>(varint(std::numeric_limits<T>::max()));
  }

  /// The number of elements that follow, a varint. Fails and returns 0 if there are more than
  /// `max_elements`, or more than fit into the remaining bytes at `bytes_per_element` each. Memory
  /// for that number may therefore be reserved.
  [[nodiscard]] std::size_t count(std::size_t max_elements, std::size_t bytes_per_element) {
    const std::uint64_t elements = varint(max_elements);
    if (bytes_per_element > 0 && elements > rest_.size() / bytes_per_element) return fail();
    return static_cast<std::size_t>(elements);
  }

  /// The next `size` bytes; empty if there are fewer.
  [[nodiscard]] std::span<const std::uint8_t> bytes(std::size_t size) {
    if (failed_ || size > rest_.size()) {
      fail();
      return {};
    }
    const auto values = rest_.first(size);
    rest_ = rest_.subspan(size);
    return values;
  }

  [[nodiscard]] std::size_t left() const { return rest_.size(); }
  [[nodiscard]] bool failed() const { return failed_; }
  /// True if everything was read and nothing failed.
  [[nodiscard]] bool done() const { return !failed_ && rest_.empty(); }

  /// Marks the input as unusable; no bytes remain afterwards. Returns 0.
  std::uint8_t fail() {
    failed_ = true;
    rest_ = {};
    return 0;
  }

 private:
  template <std::unsigned_integral T>
  T fixed() {
    const auto values = bytes(sizeof(T));
    T value = 0;
    for (std::size_t k = 0; k < values.size(); ++k)
      value = static_cast<T>(value | static_cast<T>(T{values[k]} << (8U * k)));
    return value;
  }

  std::span<const std::uint8_t> rest_;
  bool failed_ = false;
};

}  // namespace km

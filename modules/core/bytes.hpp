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

/// What an FNV-1a hash begins with.
inline constexpr std::uint64_t kFnv1aBasis = 0xcbf29ce484222325ULL;

/// Mixes `value` into `hash`, byte by byte: FNV-1a (Fowler, Noll, Vo), 64 bits.
inline void mix_fnv1a(std::uint64_t& hash, std::uint64_t value) {
  for (int byte = 0; byte < 8; ++byte) {
    hash ^= (value >> (8 * byte)) & 0xffU;
    hash *= 0x100000001b3ULL;
  }
}

/// Mixes `bytes` into `hash`, eight at a time, the least significant first. The last eight may lack
/// some, which count as zeros: mix in the number of bytes, too.
inline void mix_fnv1a(std::uint64_t& hash, std::span<const std::uint8_t> bytes) {
  for (std::size_t begin = 0; begin < bytes.size(); begin += 8) {
    const auto eight = bytes.subspan(begin, std::min<std::size_t>(8, bytes.size() - begin));
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < eight.size(); ++k) value |= std::uint64_t{eight[k]} << (8U * k);
    mix_fnv1a(hash, value);
  }
}

/// Puts numbers one after the other, least significant byte first, whatever the machine.
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

  /// As they are, without their number.
  void bytes(std::span<const std::uint8_t> values) {
    bytes_.insert(bytes_.end(), values.begin(), values.end());
  }

  [[nodiscard]] std::size_t size() const { return bytes_.size(); }

  /// What has been written; the writer is empty afterwards.
  [[nodiscard]] std::vector<std::uint8_t> release() { return std::exchange(bytes_, {}); }

 private:
  template <std::unsigned_integral T>
  void fixed(T value) {
    for (std::size_t k = 0; k < sizeof(T); ++k)
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8U * k)));
  }

  std::vector<std::uint8_t> bytes_;
};

/// Reads what ByteWriter wrote, and trusts nothing. A read past the end, or of what cannot be
/// right, gives zero and fails the reader for good: check done() or failed() once, at the end.
/// The bytes outlive it.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  [[nodiscard]] std::uint8_t u8() { return fixed<std::uint8_t>(); }
  [[nodiscard]] std::uint16_t u16() { return fixed<std::uint16_t>(); }
  [[nodiscard]] std::uint32_t u32() { return fixed<std::uint32_t>(); }
  [[nodiscard]] std::uint64_t u64() { return fixed<std::uint64_t>(); }
  [[nodiscard]] float f32() { return std::bit_cast<float>(fixed<std::uint32_t>()); }
  [[nodiscard]] double f64() { return std::bit_cast<double>(fixed<std::uint64_t>()); }

  /// Fails for numbers above `max` and for those written with more bytes than they need, so that
  /// equal numbers have equal bytes.
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

  /// How many elements follow, a varint. Fails, with 0, for more than `max_elements` and for more
  /// than can be in what is left if each takes at least `bytes_per_element`: memory may be reserved
  /// for that many.
  [[nodiscard]] std::size_t count(std::size_t max_elements, std::size_t bytes_per_element) {
    const std::uint64_t elements = varint(max_elements);
    if (bytes_per_element > 0 && elements > rest_.size() / bytes_per_element) return fail();
    return static_cast<std::size_t>(elements);
  }

  /// The next `size` bytes; empty if there are not as many.
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

  /// Marks what was read as unusable; nothing is left afterwards. Returns 0.
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

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/bytes.hpp"
#include "modules/core/decoded.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Reads the fields of a ROS message one after the other, whichever way they were written:
///   "ros1"  ROS 1: little endian, without gaps (wiki.ros.org/msg);
///   "cdr"   ROS 2: OMG's CDR as DDS writes it (DDS-XTypes, XCDR version 1, plain): an
///           encapsulation header of four bytes that says the byte order; numbers lie at multiples
///           of their size behind it.
/// Trusts nothing, as ByteReader: after a read that fails all are zero or empty. The bytes outlive
/// it.
class RosWire {
 public:
  /// Refuses other encodings, and encapsulations with parameter lists or of XCDR version 2.
  static Decoded<RosWire> open(std::string_view encoding, std::span<const std::uint8_t> bytes);

  [[nodiscard]] std::uint8_t u8() { return reader_.u8(); }
  [[nodiscard]] std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  [[nodiscard]] double f64();
  void f64(std::span<double> values);
  [[nodiscard]] std::string text();
  /// uint8[].
  [[nodiscard]] std::vector<std::uint8_t> octets();
  /// float64[].
  [[nodiscard]] std::vector<double> doubles();
  /// How many elements follow, each of at least `bytes_per_element`: fails for more than can be.
  [[nodiscard]] std::size_t count(std::size_t bytes_per_element);
  /// std_msgs/Header's number, which only ROS 1 has.
  void skip_sequence();
  /// builtin_interfaces/Time [ns].
  [[nodiscard]] Stamp stamp();

  /// Why what was read is no message: it is cut or goes on; null if it is one.
  [[nodiscard]] const char* problem() const;
  [[nodiscard]] bool failed() const { return reader_.failed(); }
  void fail() { reader_.fail(); }

 private:
  RosWire(std::span<const std::uint8_t> bytes, bool is_cdr, bool is_big_endian)
      : reader_(bytes), size_(bytes.size()), is_cdr_(is_cdr), is_big_endian_(is_big_endian) {}

  [[nodiscard]] std::uint64_t number(std::size_t size);

  ByteReader reader_;
  std::size_t size_;
  bool is_cdr_;
  bool is_big_endian_;
};

}  // namespace km

#include "modules/recordings/ros_wire.hpp"

#include <bit>

namespace km {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

Decoded<RosWire> RosWire::open(std::string_view encoding, std::span<const std::uint8_t> bytes) {
  using Result = Decoded<RosWire>;
  constexpr std::size_t kEncapsulation_bytes = 4;
  if (encoding == "ros1") return Result::accept(RosWire(bytes, false, false));
  if (encoding != "cdr") return Result::refuse("an encoding that is not known");
  if (bytes.size() < kEncapsulation_bytes) return Result::refuse("no encapsulation header");
  // The second octet of the identifier; its options say nothing that reading needs.
  constexpr std::uint8_t kBigEndian = 0, kLittleEndian = 1;
  if (bytes[0] != 0 || (bytes[1] != kBigEndian && bytes[1] != kLittleEndian))
    return Result::refuse("an encapsulation other than plain CDR");
  return Result::accept(RosWire(bytes.subspan(kEncapsulation_bytes), true, bytes[1] == kBigEndian));
}

std::uint64_t RosWire::number(std::size_t size) {
  const std::size_t at = size_ - reader_.left();
  if (is_cdr_) static_cast<void>(reader_.bytes((size - at % size) % size));
  const auto octets = reader_.bytes(size);
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < octets.size(); ++k)
    value |= std::uint64_t{octets[k]} << (8U * (is_big_endian_ ? octets.size() - 1 - k : k));
  return value;
}

double RosWire::f64() {
  return std::bit_cast<double>(number(8));
}

void RosWire::f64(std::span<double> values) {
  for (double& value : values) value = f64();
}

std::string RosWire::text() {
  const auto octets = reader_.bytes(u32());
  const bool has_end = is_cdr_ && !octets.empty();  // some writers leave out that of an empty text
  if (has_end && octets.back() != 0) reader_.fail();
  return {octets.begin(), octets.end() - (has_end ? 1 : 0)};
}

std::vector<std::uint8_t> RosWire::octets() {
  const auto octets = reader_.bytes(u32());
  return {octets.begin(), octets.end()};
}

std::vector<double> RosWire::doubles() {
  std::vector<double> values(count(sizeof(double)));
  f64(values);
  return values;
}

std::size_t RosWire::count(std::size_t bytes_per_element) {
  const std::uint32_t elements = u32();
  return elements <= reader_.left() / bytes_per_element ? elements : reader_.fail();
}

void RosWire::skip_sequence() {
  if (!is_cdr_) static_cast<void>(u32());
}

Stamp RosWire::stamp() {
  const std::uint32_t seconds = u32();
  const std::uint32_t rest_ns = u32();
  // Signed in ROS 2, unsigned in ROS 1.
  const Stamp whole = is_cdr_ ? Stamp{static_cast<std::int32_t>(seconds)} : Stamp{seconds};
  return whole * kSecond_ns + rest_ns;
}

const char* RosWire::problem() const {
  constexpr std::size_t kMostPadding_bytes = 3;
  if (reader_.failed()) return "a message that is cut or not of its type";
  if (reader_.left() > (is_cdr_ ? kMostPadding_bytes : 0)) return "a message longer than its type";
  return nullptr;
}

}  // namespace km

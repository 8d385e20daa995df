#include "modules/recordings/ros_serialization.hpp"

namespace km {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

Decoded<RosReader> RosReader::open(std::string_view encoding, std::span<const std::uint8_t> bytes) {
  using Result = Decoded<RosReader>;
  constexpr std::size_t kEncapsulation_bytes = 4;
  if (encoding == "ros1") return Result::accept(RosReader(bytes, false, false));
  if (encoding != "cdr") return Result::refuse("an unknown encoding");
  if (bytes.size() < kEncapsulation_bytes) return Result::refuse("no encapsulation header");
  // Values of the second byte of the representation identifier.
  constexpr std::uint8_t kBigEndian = 0, kLittleEndian = 1;
  if (bytes[0] != 0 || (bytes[1] != kBigEndian && bytes[1] != kLittleEndian))
    return Result::refuse("an encapsulation other than plain CDR");
  return Result::accept(
      RosReader(bytes.subspan(kEncapsulation_bytes), true, bytes[1] == kBigEndian));
}

std::uint64_t RosReader::number(std::size_t size) {
  const std::size_t at = size_ - reader_.left();
  if (is_cdr_) static_cast<void>(reader_.bytes((size - at % size) % size));
  const auto octets = reader_.bytes(size);
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < octets.size(); ++k)
    value |= std::uint64_t{octets[k]} << (8U * (is_big_endian_ ? octets.size() - 1 - k : k));
  return value;
}

void RosReader::get(std::string& value) {
  const auto octets = reader_.bytes(number(4));
  // CDR ends a text with a zero, which some writers omit for an empty text.
  const bool has_end = is_cdr_ && !octets.empty();
  if (has_end && octets.back() != 0) reader_.fail();
  value.assign(octets.begin(), octets.end() - (has_end ? 1 : 0));
}

void RosReader::get(std::vector<std::uint8_t>& values) {
  const auto octets = reader_.bytes(number(4));
  values.assign(octets.begin(), octets.end());
}

void RosReader::get(Stamp& value) {
  const auto seconds = static_cast<std::uint32_t>(number(4));
  const auto rest_ns = static_cast<std::uint32_t>(number(4));
  // Seconds are signed in ROS 2 and unsigned in ROS 1.
  const Stamp whole = is_cdr_ ? Stamp{static_cast<std::int32_t>(seconds)} : Stamp{seconds};
  value = whole * kSecond_ns + rest_ns;
}

const char* RosReader::problem() const {
  constexpr std::size_t kMostPadding_bytes = 3;
  if (reader_.failed()) return "a message that is truncated or not of its type";
  if (reader_.left() > (is_cdr_ ? kMostPadding_bytes : 0)) return "a message longer than its type";
  return nullptr;
}

void RosWriter::number(std::uint64_t value, std::size_t size) {
  constexpr std::size_t kEncapsulation_bytes = 4;
  while ((bytes_.size() - kEncapsulation_bytes) % size != 0) bytes_.push_back(0);
  for (std::size_t k = 0; k < size; ++k)
    bytes_.push_back(static_cast<std::uint8_t>(value >> (8U * k)));
}

void RosWriter::put(const std::string& value) {
  number(value.size() + 1, 4);
  bytes_.insert(bytes_.end(), value.begin(), value.end());
  bytes_.push_back(0);
}

void RosWriter::put(const std::vector<std::uint8_t>& values) {
  number(values.size(), 4);
  bytes_.insert(bytes_.end(), values.begin(), values.end());
}

void RosWriter::put(Stamp value) {
  Stamp seconds = value / kSecond_ns, rest_ns = value % kSecond_ns;
  if (rest_ns < 0) --seconds, rest_ns += kSecond_ns;
  (*this)(static_cast<std::uint32_t>(seconds), static_cast<std::uint32_t>(rest_ns));
}

}  // namespace km

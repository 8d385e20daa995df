#include "modules/recordings/ros_messages.hpp"

#include <algorithm>
#include <stdexcept>

namespace km {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::string_view fields_of(std::string_view type) {
  const auto* const known = std::ranges::find(kRosDefinitions, type, &RosDefinition::type);
  if (known == std::end(kRosDefinitions))
    throw std::invalid_argument("no definition of messages of " + std::string(type));
  return known->fields;
}

// Types of messages in a list of fields. A blank, or "[" for arrays, follows the type of a field.
std::vector<std::string_view> types_in(std::string_view fields) {
  std::vector<std::string_view> types;
  while (!fields.empty()) {
    const std::string_view type = fields.substr(0, fields.find_first_of(" ["));
    if (type.find('/') != type.npos) types.push_back(type);
    fields.remove_prefix(fields.find('\n') + 1);
  }
  return types;
}

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

bool is_of_type(const BagChannel& channel, std::string_view type) {
  if (type == RosTFMessage::kType && channel.type == "tf/tfMessage") return true;  // former name
  return channel.type == type || ros1_name(channel.type) == type;
}

std::string ros2_name(std::string_view type) {
  const std::size_t slash = type.find('/');
  return std::string(type.substr(0, slash)) + "/msg" + std::string(type.substr(slash));
}

std::string ros1_name(std::string_view type) {
  constexpr std::string_view kDds = "::dds_::";
  if (const std::size_t dds = type.find(kDds); dds != type.npos && type.ends_with('_')) {
    const std::string package(type.substr(0, type.find("::")));
    type.remove_suffix(1);
    return package + '/' + std::string(type.substr(dds + kDds.size()));
  }
  const std::size_t slash = type.find("/msg/");
  if (slash == type.npos) return std::string(type);
  return std::string(type.substr(0, slash)) + std::string(type.substr(slash + 4));
}

std::string ros_name(std::string name) {
  for (char& c : name) {
    const bool is_fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!is_fine) c = '_';
  }
  return name;
}

std::string ros_definition(std::string_view type) {
  constexpr std::size_t kRule = 80;  // characters
  const std::string rule(kRule, '=');
  std::string text(fields_of(type));
  std::vector<std::string_view> types = types_in(fields_of(type));
  for (std::size_t k = 0; k < types.size(); ++k) {
    if (std::ranges::find(types, types[k]) - types.begin() != static_cast<std::ptrdiff_t>(k))
      continue;
    const std::string_view fields = fields_of(types[k]);
    text += rule + "\nMSG: " + std::string(types[k]) + '\n' + std::string(fields);
    const auto more = types_in(fields);
    types.insert(types.end(), more.begin(), more.end());
  }
  return text;
}

}  // namespace km

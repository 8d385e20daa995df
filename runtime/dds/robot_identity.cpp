#include "runtime/dds/robot_identity.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <optional>
#include <random>
#include <stdexcept>

namespace km {
namespace {

constexpr std::size_t kMaxNameLength = 64;
constexpr std::size_t kMaxUserData = 1024;

bool is_name(std::string_view name) {
  const auto allowed = [](char c) { return c >= ' ' && c <= '~' && c != ';'; };
  return !name.empty() && name.size() <= kMaxNameLength && std::ranges::all_of(name, allowed);
}

template <typename T>
std::optional<T> number(std::string_view text, int base) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

constexpr std::array<std::string_view, 5> kKeys = {"robot", "name", "proto", "boot", "keys"};
using Fields = std::array<std::optional<std::string_view>, kKeys.size()>;

// The values by key; nullopt if a known key appears twice.
std::optional<Fields> split(std::string_view bytes) {
  Fields fields;
  while (!bytes.empty()) {
    const std::string_view entry = bytes.substr(0, bytes.find(';'));
    bytes.remove_prefix(std::min(bytes.size(), entry.size() + 1));
    const std::string_view key = entry.substr(0, entry.find('='));
    const auto known = std::ranges::find(kKeys, key);
    if (known == kKeys.end()) continue;
    auto& field = fields[static_cast<std::size_t>(known - kKeys.begin())];
    if (field) return std::nullopt;
    field = entry.substr(std::min(entry.size(), key.size() + 1));
  }
  return fields;
}

}  // namespace

std::string to_string(const RobotIdentity& identity) {
  return identity.name + " (id " + std::to_string(identity.robot) + ')';
}

std::uint64_t random_boot_id() {
  std::random_device device;
  std::uint64_t incarnation = 0;
  while (incarnation == 0) {
    incarnation = device();
    incarnation = ((incarnation << 32U) ^ device()) >> kResumeBits;
  }
  return incarnation << kResumeBits;
}

std::string to_user_data(const RobotIdentity& identity, std::string_view credentials) {
  if (!is_name(identity.name))
    throw std::invalid_argument("robot name '" + identity.name +
                                "' is not 1 to 64 printable ASCII characters without ';'");
  char boot[17];
  std::snprintf(boot, sizeof boot, "%016llx", static_cast<unsigned long long>(identity.boot));
  return "robot=" + std::to_string(identity.robot) + ";name=" + identity.name +
         ";proto=" + std::to_string(identity.protocol) + ";boot=" + boot +
         (credentials.empty() ? "" : ";keys=" + std::string(credentials));
}

bool claims_to_be_a_robot(std::string_view bytes) {
  return bytes.starts_with("robot=");
}

Decoded<Announcement> parse_user_data(std::string_view bytes) {
  using Result = Decoded<Announcement>;
  if (bytes.size() > kMaxUserData) return Result::refuse("user data too long");
  const auto fields = split(bytes);
  if (!fields) return Result::refuse("user data names a field twice");
  const auto& [robot_text, name, protocol_text, boot_text, keys] = *fields;
  if (!robot_text || !name || !protocol_text || !boot_text)
    return Result::refuse("user data lacks a field");

  const auto robot = number<RobotId>(*robot_text, 10);
  const auto protocol = number<std::uint16_t>(*protocol_text, 10);
  const auto boot = number<std::uint64_t>(*boot_text, 16);
  if (!robot) return Result::refuse("robot id is not a 16-bit number");
  if (!is_name(*name)) return Result::refuse("robot name is not printable");
  if (!protocol) return Result::refuse("protocol version is not a 16-bit number");
  if (!boot || *boot == 0) return Result::refuse("boot id is not a nonzero 64-bit number");
  return Result::accept({{*robot, std::string(*name), *protocol, *boot},
                         std::string(keys.value_or(std::string_view()))});
}

}  // namespace km

#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace km {

/// Something that robots send each other, as its readers see it.
struct MessageReader {
  std::string name;
  /// What the robot does with such bytes from another robot until they are a message or refused.
  std::function<bool(std::span<const std::uint8_t>)> accepts;
  std::vector<std::vector<std::uint8_t>> samples;  ///< That are accepted.
};

/// What travels on every topic (idl/envelope.idl), as DDS itself reads it, whoever has sent it.
[[nodiscard]] MessageReader envelope_messages();

/// That, and one for each topic between robots, and for each form of letter that solvers send in
/// parcels.
[[nodiscard]] std::vector<MessageReader> all_messages();

/// Checks that `reader` does not harm the process with these bytes: run it under a sanitizer or
/// valgrind. The bytes lie at the end of an allocation of their own. Returns what it says.
bool feed(const MessageReader& reader, std::span<const std::uint8_t> bytes);

}  // namespace km

#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace km {

/// A kind of message between robots, as its receiver sees it.
struct MessageReader {
  std::string name;
  /// Processing of bytes from another robot until they are accepted as a message or refused.
  std::function<bool(std::span<const std::uint8_t>)> accepts;
  std::vector<std::vector<std::uint8_t>> samples;  ///< Accepted messages.
};

/// Envelopes of every topic (idl/envelope.idl), as DDS itself reads them from any sender.
[[nodiscard]] MessageReader envelope_messages();

/// Envelopes, one reader for each topic between robots, and one for each message of the solvers.
[[nodiscard]] std::vector<MessageReader> all_messages();

/// Checks that `reader` does not harm the process with these bytes: run it under a sanitizer or
/// valgrind. The bytes are at the end of an allocation of their own. Returns the result of
/// `reader`.
bool feed(const MessageReader& reader, std::span<const std::uint8_t> bytes);

}  // namespace km

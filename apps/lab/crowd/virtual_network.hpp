#pragma once

#include <cstddef>

namespace km {

// Bytes of the messages between robots. The laboratory does not link the codecs, which need DDS: a
// test compares the sizes here with those of the codecs.

/// Content of messages: XCDR2.
[[nodiscard]] constexpr std::size_t bag_bytes(std::size_t packed) {
  return 48 + packed;
}
[[nodiscard]] constexpr std::size_t request_bytes() {
  return 24;
}
[[nodiscard]] constexpr std::size_t words_bytes(std::size_t points) {
  return 32 + 6 * points;
}
/// Descriptors of the points whose words were sent.
[[nodiscard]] constexpr std::size_t reply_bytes(std::size_t points) {
  return 224 + 12 * points;
}
[[nodiscard]] constexpr std::size_t closure_bytes() {
  return 500;
}
/// Status of a robot with a name of 4 to 7 characters, while all robots receive each other. It goes
/// to all others at the StatusPace.
[[nodiscard]] constexpr std::size_t status_bytes() {
  return 64;
}
/// Answer of an owner: a keyframe of the receiver, and the keyframe that may show the same place.
[[nodiscard]] constexpr std::size_t answer_bytes() {
  return 24;
}

/// Ethernet bytes of a message for one reader, its share of heartbeats and acknowledgements
/// included. The envelope adds 32 bytes and pads the content to a multiple of 4. Every started 1300
/// bytes add 128, and every message 30. These two numbers fit counters of interfaces with Cyclone
/// DDS 0.10.2 (MaxMessageSize 1400 B, FragmentSize 1300 B, samples of 0.4 kB to 2 MB).
[[nodiscard]] constexpr std::size_t wire_bytes(std::size_t content) {
  constexpr std::size_t kEnvelope = 32;
  constexpr std::size_t kFragment = 1300;
  const std::size_t serialized = kEnvelope + (content + 3) / 4 * 4;
  return serialized + 128 * ((serialized + kFragment - 1) / kFragment) + 30;
}

/// Messages of one robot.
struct CrowdTraffic {
  std::size_t messages = 0;
  std::size_t bytes = 0;  ///< wire_bytes().

  void add(std::size_t content, std::size_t readers = 1) {
    messages += readers;
    bytes += readers * wire_bytes(content);
  }
};

}  // namespace km

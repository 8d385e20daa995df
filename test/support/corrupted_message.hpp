#pragma once

#include "runtime/dds/codec.hpp"
#include "test/support/test.hpp"

namespace km {

/// A received message and its writer.
template <typename T>
struct Arrived : Codec<T>::Encoded {
  TeamPeer writer;
};

template <typename T>
[[nodiscard]] Arrived<T> encoded_by(TeamPeer writer, const T& message) {
  return {Codec<T>::encode(message), writer};
}
template <typename T>
[[nodiscard]] Arrived<T> encoded_by(RobotId writer, const T& message) {
  return encoded_by(TeamPeer{writer, 1}, message);
}

template <typename T>
[[nodiscard]] Decoded<T> decoded(const Arrived<T>& message) {
  return Codec<T>::decode(message.wire, message.writer);
}

/// A way to corrupt a message, and the expected reason for its refusal.
template <typename T>
struct Corruption {
  const char* what;
  const char* reason;
  std::function<void(Arrived<T>&)> corrupt;
};

/// Checks each of `ways` on a new message by `make`.
template <typename T, typename Make>
void check_refusals(const Make& make, const std::vector<Corruption<T>>& ways) {
  for (const Corruption<T>& way : ways) {
    CAPTURE(way.what);
    Arrived<T> message = make();
    REQUIRE(decoded(message).value);
    way.corrupt(message);
    const Decoded<T> result = decoded(message);
    CHECK_FALSE(result.value);
    CHECK(std::string(result.refusal == nullptr ? "" : result.refusal) == way.reason);
  }
}

}  // namespace km

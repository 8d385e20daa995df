#pragma once

#include <catch2/catch.hpp>
#include <functional>
#include <string>
#include <vector>

#include "runtime/dds/codec.hpp"

namespace km {

/// `message` as it arrives: with the writer's header.
template <typename T>
[[nodiscard]] typename Codec<T>::Encoded encoded_by(RobotId writer, const T& message) {
  auto encoded = Codec<T>::encode(message);
  encoded.wire.header.robot = writer;
  return encoded;
}

/// A way to spoil a message, and what it must be refused for.
template <typename T>
struct Spoilt {
  const char* what;
  const char* reason;
  std::function<void(typename Codec<T>::Encoded&)> spoil;
};

/// Checks each of `ways` on a fresh message by `make`.
template <typename T, typename Make>
void check_refusals(const Make& make, const std::vector<Spoilt<T>>& ways) {
  for (const Spoilt<T>& way : ways) {
    CAPTURE(way.what);
    typename Codec<T>::Encoded encoded = make();
    REQUIRE(Codec<T>::decode(encoded.wire).value);
    way.spoil(encoded);
    const Decoded<T> decoded = Codec<T>::decode(encoded.wire);
    CHECK_FALSE(decoded.value);
    CHECK(std::string(decoded.refusal == nullptr ? "" : decoded.refusal) == way.reason);
  }
}

}  // namespace km

#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "modules/security/key_types.hpp"

namespace km {

/// Octets of hexadecimal digits, as published examples have them.
[[nodiscard]] inline Octets octets_from_hex(std::string_view digits) {
  Octets octets;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    octets.push_back(
        static_cast<std::uint8_t>(std::stoul(std::string(digits.substr(i, 2)), nullptr, 16)));
  return octets;
}

template <std::size_t N>
[[nodiscard]] std::array<std::uint8_t, N> array_from_hex(std::string_view digits) {
  std::array<std::uint8_t, N> octets{};
  std::ranges::copy(octets_from_hex(digits.substr(0, 2 * N)), octets.begin());
  return octets;
}

template <std::size_t N>
[[nodiscard]] Secret<N> secret_from_hex(std::string_view digits) {
  Secret<N> secret;
  std::ranges::copy(octets_from_hex(digits.substr(0, 2 * N)), secret.data());
  return secret;
}

}  // namespace km

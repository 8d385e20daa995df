#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace km {

using Octets = std::vector<std::uint8_t>;
using OctetView = std::span<const std::uint8_t>;

/// Ed25519 (RFC 8032): public key and signature of a signer.
using PublicKey = std::array<std::uint8_t, 32>;
using Signature = std::array<std::uint8_t, 64>;

/// Bytes that the destructor overwrites with zeros.
template <std::size_t N>
class Secret {
 public:
  Secret() = default;
  Secret(const Secret&) = default;
  Secret& operator=(const Secret&) = default;
  ~Secret() {
    // A volatile write is not optimised away, although nothing reads the bytes any more.
    for (volatile std::uint8_t& octet : octets_) octet = 0;
  }

  [[nodiscard]] std::uint8_t* data() { return octets_.data(); }
  [[nodiscard]] const std::uint8_t* data() const { return octets_.data(); }
  [[nodiscard]] static constexpr std::size_t size() { return N; }

 private:
  std::array<std::uint8_t, N> octets_{};
};

/// Ed25519, in libsodium's form: the seed and the public key.
using SigningKey = Secret<64>;

/// Key of XChaCha20-Poly1305.
using SealingKey = Secret<32>;

}  // namespace km

#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "modules/security/key_types.hpp"

namespace km {

using Nonce = std::array<std::uint8_t, 24>;

/// Bytes that encrypt() adds: nonce 24, tag 16.
inline constexpr std::size_t kEncryptionBytes = 24 + 16;

/// A fresh nonce, drawn at random.
[[nodiscard]] Nonce random_nonce();

/// A fresh key.
[[nodiscard]] SealingKey make_sealing_key();

/// XChaCha20-Poly1305 (draft-irtf-cfrg-xchacha-03): appends nonce, ciphertext and tag to `out`. The
/// tag covers `associated`, too. Never use a nonce twice under one key.
void encrypt(const SealingKey& key, const Nonce& nonce, OctetView associated, OctetView content,
             Octets& out);

/// Inverse of encrypt(). nullopt unless the bytes were encrypted with this key and this
/// `associated`.
[[nodiscard]] std::optional<Octets> decrypt(const SealingKey& key, OctetView associated,
                                            OctetView encrypted);

}  // namespace km

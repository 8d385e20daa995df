#pragma once

#include <string_view>

#include "modules/core/bytes.hpp"
#include "modules/security/key_types.hpp"

namespace km {

/// Starts libsodium; may be called again, from any thread. Throws std::runtime_error if the system
/// gives no random numbers. What draws a key or a nonce calls it itself.
void start_sodium();

/// The begin of what is signed or authenticated: what kind of statement it is, so that a signature
/// under one never passes for one under another.
[[nodiscard]] ByteWriter statement(std::string_view kind);

/// Puts a text behind its length, so that no two sequences of fields have equal octets.
void put_text(ByteWriter& statement, std::string_view text);

/// A fresh Ed25519 key.
[[nodiscard]] SigningKey make_signing_key();

/// The key that an RFC 8032 private key (32 octets) stands for, and back.
[[nodiscard]] SigningKey signing_key_from(const Secret<32>& seed);
[[nodiscard]] Secret<32> seed_of(const SigningKey& key);

[[nodiscard]] PublicKey public_key_of(const SigningKey& key);

/// Ed25519 (RFC 8032, pure).
[[nodiscard]] Signature sign(OctetView statement, const SigningKey& key);

/// True if the owner of `key` signed exactly this. Refuses what RFC 8032 lets a verifier refuse:
/// other spellings of a signature, keys of small order.
[[nodiscard]] bool verify(OctetView statement, const Signature& signature, const PublicKey& key);

}  // namespace km

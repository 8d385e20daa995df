#pragma once

#include <string_view>

#include "modules/core/io/bytes.hpp"
#include "modules/security/key_types.hpp"

namespace km {

/// Starts libsodium; may be called again, from any thread. Throws std::runtime_error if the system
/// gives no random numbers. Functions that draw a key or a nonce call it themselves.
void start_sodium();

/// Beginning of a statement to sign or authenticate. It states the kind, so that a signature of one
/// kind is never valid for another.
[[nodiscard]] ByteWriter statement(std::string_view kind);

/// Appends the length and then the text, so that different sequences of fields have different
/// bytes.
void put_text(ByteWriter& statement, std::string_view text);

/// A fresh Ed25519 key.
[[nodiscard]] SigningKey make_signing_key();

/// Converts an RFC 8032 private key (32 octets) to a signing key, and back.
[[nodiscard]] SigningKey signing_key_from(const Secret<32>& seed);
[[nodiscard]] Secret<32> seed_of(const SigningKey& key);

[[nodiscard]] PublicKey public_key_of(const SigningKey& key);

/// Signature of `statement` by Ed25519 (RFC 8032, pure).
[[nodiscard]] Signature sign(OctetView statement, const SigningKey& key);

/// True if the owner of `key` signed exactly `statement`. Also refuses non-canonical signatures and
/// keys of small order, as RFC 8032 permits.
[[nodiscard]] bool verify(OctetView statement, const Signature& signature, const PublicKey& key);

}  // namespace km

#include "modules/security/signing.hpp"

#include <sodium.h>

#include <stdexcept>

namespace km {

static_assert(PublicKey().size() == crypto_sign_PUBLICKEYBYTES);
static_assert(Signature().size() == crypto_sign_BYTES);
static_assert(SigningKey::size() == crypto_sign_SECRETKEYBYTES);
static_assert(Secret<32>::size() == crypto_sign_SEEDBYTES);

void start_sodium() {
  if (sodium_init() < 0) throw std::runtime_error("libsodium cannot start: is /dev/urandom there?");
}

ByteWriter statement(std::string_view kind) {
  ByteWriter writer;
  put_text(writer, kind);
  return writer;
}

void put_text(ByteWriter& statement, std::string_view text) {
  statement.varint(text.size());
  statement.bytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

SigningKey make_signing_key() {
  start_sodium();
  SigningKey key;
  PublicKey ignored;
  crypto_sign_keypair(ignored.data(), key.data());
  return key;
}

SigningKey signing_key_from(const Secret<32>& seed) {
  SigningKey key;
  PublicKey ignored;
  crypto_sign_seed_keypair(ignored.data(), key.data(), seed.data());
  return key;
}

Secret<32> seed_of(const SigningKey& key) {
  Secret<32> seed;
  crypto_sign_ed25519_sk_to_seed(seed.data(), key.data());
  return seed;
}

PublicKey public_key_of(const SigningKey& key) {
  PublicKey public_key;
  crypto_sign_ed25519_sk_to_pk(public_key.data(), key.data());
  return public_key;
}

Signature sign(OctetView statement, const SigningKey& key) {
  Signature signature;
  crypto_sign_detached(signature.data(), nullptr, statement.data(), statement.size(), key.data());
  return signature;
}

bool verify(OctetView statement, const Signature& signature, const PublicKey& key) {
  return crypto_sign_verify_detached(signature.data(), statement.data(), statement.size(),
                                     key.data()) == 0;
}

}  // namespace km

#include "modules/security/authenticated_encryption.hpp"

#include <sodium.h>

#include "modules/security/signing.hpp"

namespace km {
namespace {

constexpr std::size_t kTagBytes = crypto_aead_xchacha20poly1305_ietf_ABYTES;

static_assert(Nonce().size() == crypto_aead_xchacha20poly1305_ietf_NPUBBYTES);
static_assert(SealingKey::size() == crypto_aead_xchacha20poly1305_ietf_KEYBYTES);
static_assert(kEncryptionBytes == Nonce().size() + kTagBytes);

}  // namespace

Nonce random_nonce() {
  start_sodium();
  Nonce nonce;
  randombytes_buf(nonce.data(), nonce.size());
  return nonce;
}

SealingKey make_sealing_key() {
  start_sodium();
  SealingKey key;
  crypto_aead_xchacha20poly1305_ietf_keygen(key.data());
  return key;
}

void encrypt(const SealingKey& key, const Nonce& nonce, OctetView associated, OctetView content,
             Octets& out) {
  out.insert(out.end(), nonce.begin(), nonce.end());
  const std::size_t begin = out.size();
  out.resize(begin + content.size() + kTagBytes);
  crypto_aead_xchacha20poly1305_ietf_encrypt(out.data() + begin, nullptr, content.data(),
                                             content.size(), associated.data(), associated.size(),
                                             nullptr, nonce.data(), key.data());
}

std::optional<Octets> decrypt(const SealingKey& key, OctetView associated, OctetView encrypted) {
  if (encrypted.size() < kEncryptionBytes) return std::nullopt;
  const OctetView nonce = encrypted.first(Nonce().size());
  const OctetView ciphertext = encrypted.subspan(nonce.size());
  Octets content(ciphertext.size() - kTagBytes);
  if (crypto_aead_xchacha20poly1305_ietf_decrypt(
          content.data(), nullptr, nullptr, ciphertext.data(), ciphertext.size(), associated.data(),
          associated.size(), nonce.data(), key.data()) != 0)
    return std::nullopt;
  return content;
}

}  // namespace km

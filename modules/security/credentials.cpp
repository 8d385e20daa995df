#include "modules/security/credentials.hpp"

#include <sodium.h>

#include <algorithm>

#include "modules/security/signing.hpp"

namespace km {
namespace {

constexpr std::uint8_t kFormat = 1;
constexpr int kBase64 = sodium_base64_VARIANT_URLSAFE_NO_PADDING;
constexpr std::size_t kCredentialsOctets = 1 + 8 + 32 + 8 + 8 + 64 + 32 + 64;
static_assert(kCredentialsLength + 1 == sodium_base64_ENCODED_LEN(kCredentialsOctets, kBase64));

Octets statement_of(const Credentials& credentials, const RobotIdentity& identity) {
  ByteWriter writer = statement("kimera_multi start of a robot 1");
  writer.u16(identity.robot);
  put_text(writer, identity.name);
  writer.u16(identity.protocol);
  writer.u64(identity.boot);
  writer.bytes(credentials.exchange);
  writer.bytes(credentials.certificate);
  return writer.release();
}

template <std::size_t N>
void read(ByteReader& reader, std::array<std::uint8_t, N>& octets) {
  std::ranges::copy(reader.bytes(N), octets.begin());
}

}  // namespace

Credentials make_credentials(const Certificate& certificate, const PublicKey& authority,
                             const SigningKey& robot, const RobotIdentity& identity,
                             const ExchangeKey& exchange) {
  Credentials credentials{.key = certificate.key,
                          .valid_from_s = certificate.valid_from_s,
                          .valid_until_s = certificate.valid_until_s,
                          .certificate = certificate.signature,
                          .exchange = exchange};
  std::copy_n(authority.begin(), credentials.authority.size(), credentials.authority.begin());
  credentials.signature = sign(statement_of(credentials, identity), robot);
  return credentials;
}

std::string to_text(const Credentials& credentials) {
  ByteWriter writer;
  writer.u8(kFormat);
  writer.bytes(credentials.authority);
  writer.bytes(credentials.key);
  writer.u64(static_cast<std::uint64_t>(credentials.valid_from_s));
  writer.u64(static_cast<std::uint64_t>(credentials.valid_until_s));
  writer.bytes(credentials.certificate);
  writer.bytes(credentials.exchange);
  writer.bytes(credentials.signature);
  const Octets octets = writer.release();
  std::string text(kCredentialsLength + 1, '\0');
  sodium_bin2base64(text.data(), text.size(), octets.data(), octets.size(), kBase64);
  text.pop_back();  // the zero that ends a C string
  return text;
}

Decoded<Credentials> parse_credentials(std::string_view text) {
  using Result = Decoded<Credentials>;
  std::array<std::uint8_t, kCredentialsOctets> octets;
  std::size_t size = 0;
  const char* end = nullptr;
  if (text.size() != kCredentialsLength) return Result::refuse("credentials of another length");
  if (sodium_base642bin(octets.data(), octets.size(), text.data(), text.size(), nullptr, &size,
                        &end, kBase64) != 0 ||
      end != text.data() + text.size() || size != octets.size())
    return Result::refuse("credentials are not base 64");
  ByteReader reader(octets);
  if (reader.u8() != kFormat) return Result::refuse("credentials of another format");
  Credentials credentials;
  read(reader, credentials.authority);
  read(reader, credentials.key);
  credentials.valid_from_s = static_cast<std::int64_t>(reader.u64());
  credentials.valid_until_s = static_cast<std::int64_t>(reader.u64());
  read(reader, credentials.certificate);
  read(reader, credentials.exchange);
  read(reader, credentials.signature);
  // libsodium 1.0.18 accepts some characters beyond ASCII in place of others.
  if (to_text(credentials) != text) return Result::refuse("credentials are not base 64");
  return Result::accept(credentials);
}

Certificate claimed_certificate(const Credentials& credentials, const RobotIdentity& identity,
                                const std::string& team) {
  return {.team = team,
          .robot = identity.robot,
          .name = identity.name,
          .key = credentials.key,
          .valid_from_s = credentials.valid_from_s,
          .valid_until_s = credentials.valid_until_s,
          .signature = credentials.certificate};
}

bool is_signed_by_robot(const Credentials& credentials, const RobotIdentity& identity) {
  return verify(statement_of(credentials, identity), credentials.signature, credentials.key);
}

}  // namespace km

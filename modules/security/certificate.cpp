#include "modules/security/certificate.hpp"

#include <algorithm>

#include "modules/security/signing.hpp"

namespace km {
namespace {

Octets statement_of(const Certificate& certificate) {
  ByteWriter writer = statement("kimera_multi certificate 1");
  put_text(writer, certificate.team);
  writer.u16(certificate.robot);
  put_text(writer, certificate.name);
  writer.bytes(certificate.key);
  writer.u64(static_cast<std::uint64_t>(certificate.valid_from_s));
  writer.u64(static_cast<std::uint64_t>(certificate.valid_until_s));
  return writer.release();
}

Octets statement_of(const Revocations& revocations) {
  ByteWriter writer = statement("kimera_multi revocations 1");
  writer.u64(revocations.number);
  writer.varint(revocations.revoked.size());
  for (const RevokedCertificate& one : revocations.revoked) {
    writer.bytes(one.key);
    writer.u16(one.robot);
    put_text(writer, one.name);
  }
  return writer.release();
}

}  // namespace

void sign(Certificate& certificate, const SigningKey& authority) {
  certificate.signature = sign(statement_of(certificate), authority);
}

void sign(Revocations& revocations, const SigningKey& authority) {
  revocations.signature = sign(statement_of(revocations), authority);
}

bool is_signed_by(const PublicKey& authority, const Certificate& certificate) {
  return verify(statement_of(certificate), certificate.signature, authority);
}

bool is_signed_by(const PublicKey& authority, const Revocations& revocations) {
  return verify(statement_of(revocations), revocations.signature, authority);
}

const char* why_invalid(const Certificate& certificate, const Revocations& revocations,
                        std::int64_t now_s) {
  if (now_s < certificate.valid_from_s) return "certificate is not valid yet (are clocks right?)";
  if (now_s > certificate.valid_until_s) return "certificate has expired (are clocks right?)";
  if (std::ranges::any_of(revocations.revoked,
                          [&](const auto& one) { return one.key == certificate.key; }))
    return "certificate is revoked";
  return nullptr;
}

const char* why_refused(const Certificate& certificate, const PublicKey& authority,
                        const Revocations& revocations, std::int64_t now_s) {
  if (!is_signed_by(authority, certificate))
    return "certificate is not the authority's for this id, name and key";
  return why_invalid(certificate, revocations, now_s);
}

}  // namespace km

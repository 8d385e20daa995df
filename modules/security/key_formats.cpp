#include "modules/security/key_formats.hpp"

#include <limits>
#include <sstream>

#include "modules/security/key_file.hpp"
#include "modules/security/signing.hpp"

namespace km {
namespace {

constexpr const char* kSecretKeyFormat = "kimera_multi secret key 1";
constexpr const char* kCertificateFormat = "kimera_multi certificate 1";
constexpr const char* kAuthorityFormat = "kimera_multi authority 1";
constexpr const char* kRevocationsFormat = "kimera_multi revocations 1";

constexpr std::uint64_t kMaxRobotId = std::numeric_limits<RobotId>::max();

// "<public key> <robot> <name>"
RevokedCertificate revoked_from(const KeyFile& file, const KeyFile::Line& line) {
  std::istringstream words(line.value);
  std::string key, id;
  RevokedCertificate revoked;
  words >> key >> id >> revoked.name;
  file.read_hex(line, key, revoked.key.data(), revoked.key.size());
  const KeyFile::Line number{line.number, "revoked", id};
  revoked.robot = static_cast<RobotId>(file.number(number, kMaxRobotId));
  return revoked;
}

}  // namespace

SigningKey read_secret_key(const std::filesystem::path& path) {
  KeyFile file = KeyFile::read(path, kSecretKeyFormat, KeyFileAccess::kOwner);
  const SigningKey key = signing_key_from(file.secret(file.next("secret_key")));
  file.finish();
  return key;
}

Certificate read_certificate(const std::filesystem::path& path) {
  KeyFile file = KeyFile::read(path, kCertificateFormat, KeyFileAccess::kEveryone);
  Certificate certificate;
  certificate.team = file.next("team").value;
  certificate.robot = static_cast<RobotId>(file.number(file.next("robot"), kMaxRobotId));
  certificate.name = file.next("name").value;
  certificate.key = file.octets<32>(file.next("public_key"));
  certificate.valid_from_s = file.time_s(file.next("valid_from"));
  certificate.valid_until_s = file.time_s(file.next("valid_until"));
  certificate.signature = file.octets<64>(file.next("signature"));
  file.finish();
  return certificate;
}

Authority read_authority(const std::filesystem::path& path) {
  KeyFile file = KeyFile::read(path, kAuthorityFormat, KeyFileAccess::kEveryone);
  Authority authority;
  authority.team = file.next("team").value;
  authority.key = file.octets<32>(file.next("public_key"));
  file.finish();
  return authority;
}

Revocations read_revocations(const std::filesystem::path& path) {
  KeyFile file = KeyFile::read(path, kRevocationsFormat, KeyFileAccess::kEveryone);
  Revocations revocations;
  revocations.number = file.number(file.next("number"), std::numeric_limits<std::uint64_t>::max());
  while (file.next_is("revoked"))
    revocations.revoked.push_back(revoked_from(file, file.next("revoked")));
  revocations.signature = file.octets<64>(file.next("signature"));
  file.finish();
  return revocations;
}

void write_secret_key(const std::filesystem::path& file, const SigningKey& key,
                      const std::string& owner) {
  const Secret<32> seed = seed_of(key);
  write_key_file(file,
                 "# Secret key of " + owner + ". Its holder can act as this robot or authority:\n" +
                     "# mode 0600, one copy, never in mail or git.\nformat: " + kSecretKeyFormat +
                     "\nsecret_key: " + to_hex({seed.data(), seed.size()}) + '\n',
                 KeyFileAccess::kOwner);
}

void write_certificate(const std::filesystem::path& file, const Certificate& certificate) {
  std::ostringstream out;
  out << "# The team's authority certifies that this robot has this key. Everyone may read it.\n"
      << "format: " << kCertificateFormat << "\nteam: " << certificate.team
      << "\nrobot: " << certificate.robot << "\nname: " << certificate.name
      << "\npublic_key: " << to_hex(certificate.key)
      << "\nvalid_from: " << time_text(certificate.valid_from_s)
      << "\nvalid_until: " << time_text(certificate.valid_until_s)
      << "\nsignature: " << to_hex(certificate.signature) << '\n';
  write_key_file(file, out.str(), KeyFileAccess::kEveryone);
}

void write_authority(const std::filesystem::path& file, const Authority& authority) {
  write_key_file(file,
                 "# Key of the authority that the robots of this team trust. Everyone may read it, "
                 "only the authority may change it.\nformat: " +
                     std::string(kAuthorityFormat) + "\nteam: " + authority.team +
                     "\npublic_key: " + to_hex(authority.key) + '\n',
                 KeyFileAccess::kEveryone);
}

void write_revocations(const std::filesystem::path& file, const Revocations& revocations) {
  std::ostringstream out;
  out << "# Revoked certificates: public key, id and name of the robot. Everyone may "
         "read it.\nformat: "
      << kRevocationsFormat << "\nnumber: " << revocations.number << '\n';
  for (const RevokedCertificate& one : revocations.revoked)
    out << "revoked: " << to_hex(one.key) << ' ' << one.robot << ' ' << one.name << '\n';
  out << "signature: " << to_hex(revocations.signature) << '\n';
  write_key_file(file, out.str(), KeyFileAccess::kEveryone);
}

std::string fingerprint_of(const PublicKey& key) {
  return to_hex(OctetView(key).first(4));
}

}  // namespace km

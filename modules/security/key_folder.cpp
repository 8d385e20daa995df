#include "modules/security/key_folder.hpp"

#include <stdexcept>
#include <string>

#include "modules/security/key_formats.hpp"
#include "modules/security/signing.hpp"

namespace km {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
  throw std::runtime_error(file.string() + ": " + why);
}

Revocations checked_revocations(const std::filesystem::path& folder, const PublicKey& authority) {
  Revocations revocations = read_revocations(folder / kRevocationsFile);
  if (!is_signed_by(authority, revocations))
    refuse(folder / kRevocationsFile,
           "is not signed by the authority of authority.txt; copy both from the team's folder");
  return revocations;
}

}  // namespace

RobotKeys load_robot_keys(const std::filesystem::path& folder) {
  start_sodium();
  if (std::filesystem::exists(folder / kAuthorityFolder))
    refuse(folder, "is a team's folder, with the authority's secret; name a robot's folder in it");
  RobotKeys keys;
  const Authority authority = read_authority(folder / kAuthorityFile);
  keys.authority = authority.key;
  keys.secret = read_secret_key(folder / kSecretKeyFile);
  keys.certificate = read_certificate(folder / kCertificateFile);
  if (!is_signed_by(authority.key, keys.certificate))
    refuse(folder / kCertificateFile,
           "is not signed by the authority of authority.txt (key " + fingerprint_of(authority.key) +
               "): it was changed, or is another team's; copy the folder again");
  if (public_key_of(keys.secret) != keys.certificate.key)
    refuse(folder / kSecretKeyFile, "is not the secret of certificate.txt (key " +
                                        fingerprint_of(keys.certificate.key) +
                                        "); copy the folder again");
  keys.revocations = checked_revocations(folder, authority.key);
  return keys;
}

Revocations load_revocations(const std::filesystem::path& folder) {
  start_sodium();
  return checked_revocations(folder, read_authority(folder / kAuthorityFile).key);
}

}  // namespace km

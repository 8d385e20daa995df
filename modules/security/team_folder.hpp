#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "modules/security/certificate.hpp"
#include "modules/security/key_formats.hpp"

namespace km {

/// A robot that is to get keys.
struct RobotName {
  RobotId id = 0;
  std::string name;
};

/// Where a team's keys are made:
///   authority/   secret_key.txt, authority.txt, revocations.txt, and issued/ with a copy of every
///                certificate; it stays off the robots
///   NAME/        for each robot what goes onto it, see load_robot_keys()
/// What cannot be done throws std::runtime_error that names the file or the robot, and the way out.
class TeamFolder {
 public:
  /// Makes a team with an authority, and keys of these robots as issue() does. Its name is that of
  /// the folder, which must not exist or be empty. Nothing is written if the robots' names or ids
  /// cannot be.
  static TeamFolder make(const std::filesystem::path& folder, const std::vector<RobotName>& robots,
                         std::int64_t now_s, std::int64_t valid_until_s);

  /// Opens what make() made; needs the authority's secret.
  explicit TeamFolder(const std::filesystem::path& folder);

  /// Makes keys and certificates, valid between the two times [s since 1970-01-01 UTC], or none of
  /// them: ids and names must differ, and not be those of a certificate that holds at `now_s`.
  void issue(const std::vector<RobotName>& robots, std::int64_t now_s, std::int64_t valid_until_s);

  /// Revokes every certificate of a robot, given by name or else by id, in the authority's list and
  /// in the robots' folders that are here. Returns what it revoked, never nothing.
  std::vector<RevokedCertificate> revoke(const std::string& robot);

  [[nodiscard]] const Authority& authority() const { return authority_; }
  [[nodiscard]] const Revocations& revocations() const { return revocations_; }

  /// All certificates that were ever issued, by id and then time.
  [[nodiscard]] const std::vector<Certificate>& issued() const { return issued_; }

 private:
  TeamFolder() = default;
  void check(const std::vector<RobotName>& robots, std::int64_t now_s) const;
  void issue_one(const RobotName& robot, std::int64_t now_s, std::int64_t valid_until_s);
  void sort_issued();

  std::filesystem::path folder_;
  SigningKey secret_;
  Authority authority_;
  Revocations revocations_;
  std::vector<Certificate> issued_;
};

}  // namespace km

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "modules/security/certificate.hpp"
#include "modules/security/key_formats.hpp"

namespace km {

/// A robot that receives keys.
struct RobotName {
  RobotId id = 0;
  std::string name;
};

/// Folder in which a team's keys are made:
///   authority/   secret_key.txt, authority.txt, revocations.txt, and issued/ with a copy of every
///                certificate; it stays off the robots
///   NAME/        for each robot its folder of keys, see load_robot_keys()
/// Errors throw std::runtime_error that names the file or the robot, and the remedy.
class TeamFolder {
 public:
  /// Makes a team with an authority, and keys of these robots as issue() does. The folder must be
  /// empty or not yet exist, and its name becomes that of the team. Writes nothing if names or ids
  /// of the robots are invalid.
  static TeamFolder make(const std::filesystem::path& folder, const std::vector<RobotName>& robots,
                         std::int64_t now_s, std::int64_t valid_until_s);

  /// Opens a folder that make() has made; needs the authority's secret.
  explicit TeamFolder(const std::filesystem::path& folder);

  /// Makes keys and certificates that are valid from one day before `now_s`, because clocks differ,
  /// until `valid_until_s` [s since 1970-01-01 UTC]. Throws std::runtime_error and makes none if
  /// ids or names are equal, or belong to a certificate that is valid at `now_s`.
  void issue(const std::vector<RobotName>& robots, std::int64_t now_s, std::int64_t valid_until_s);

  /// Revokes every certificate of a robot, given by name or otherwise by id, in the authority's
  /// list and in the robots' folders that exist here. Returns the revoked certificates, at least
  /// one.
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

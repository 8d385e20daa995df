#include "modules/security/team_folder.hpp"

#include <algorithm>
#include <stdexcept>
#include <tuple>

#include "modules/core/config.hpp"
#include "modules/core/io/folder_name.hpp"
#include "modules/security/key_file.hpp"
#include "modules/security/signing.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIssuedFolder = "issued";

// A certificate is valid from the day before it is made, because clocks of robots may be behind.
constexpr std::int64_t kClockTolerance_s = 86400;

// Makes a folder that only its owner may enter, because it holds a secret.
void make_private_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error) fs::permissions(folder, fs::perms::owner_all, error);
  if (error)
    throw std::runtime_error(folder.string() + ": cannot make the folder: " + error.message());
}

std::string describe(RobotId id, const std::string& name) {
  return name + " (id " + std::to_string(id) + ')';
}

}  // namespace

TeamFolder TeamFolder::make(const fs::path& given, const std::vector<RobotName>& robots,
                            std::int64_t now_s, std::int64_t valid_until_s) {
  TeamFolder result;
  result.folder_ = fs::absolute(given / "").lexically_normal().parent_path();
  const std::string team = result.folder_.filename().string();
  if (!is_folder_name(team))
    throw std::runtime_error(result.folder_.string() +
                             ": the folder's name is the team's, so it is made of letters, "
                             "digits, _, - and .");
  if (fs::exists(result.folder_) && !fs::is_empty(result.folder_))
    throw std::runtime_error(result.folder_.string() +
                             ": is there already; `kimera_multi_keys add` adds robots to a team");
  result.check(robots, now_s);
  result.secret_ = make_signing_key();
  result.authority_ = {team, public_key_of(result.secret_)};
  sign(result.revocations_, result.secret_);

  const fs::path authority = result.folder_ / kAuthorityFolder;
  for (const fs::path& folder : {result.folder_, authority, authority / kIssuedFolder})
    make_private_folder(folder);
  write_secret_key(authority / kSecretKeyFile, result.secret_, "the authority of team " + team);
  write_revocations(authority / kRevocationsFile, result.revocations_);
  write_authority(authority / kAuthorityFile, result.authority_);
  result.issue(robots, now_s, valid_until_s);
  return result;
}

TeamFolder::TeamFolder(const fs::path& folder) : folder_(folder) {
  start_sodium();
  const fs::path authority = folder / kAuthorityFolder;
  authority_ = read_authority(authority / kAuthorityFile);
  secret_ = read_secret_key(authority / kSecretKeyFile);
  if (public_key_of(secret_) != authority_.key)
    throw std::runtime_error((authority / kSecretKeyFile).string() +
                             ": is not the secret of authority.txt beside it; restore both");
  revocations_ = read_revocations(authority / kRevocationsFile);
  if (!is_signed_by(authority_.key, revocations_))
    throw std::runtime_error((authority / kRevocationsFile).string() +
                             ": is not signed by this authority; restore it");
  for (const auto& entry : fs::directory_iterator(authority / kIssuedFolder)) {
    if (entry.path().extension() != ".txt") continue;
    issued_.push_back(read_certificate(entry.path()));
    if (!is_signed_by(authority_.key, issued_.back()))
      throw std::runtime_error(entry.path().string() +
                               ": is not signed by this authority; restore or remove it");
  }
  sort_issued();
}

void TeamFolder::sort_issued() {
  std::ranges::sort(issued_, {}, [](const Certificate& c) {
    return std::tuple(c.robot, c.valid_from_s, c.valid_until_s, c.key);
  });
}

void TeamFolder::check(const std::vector<RobotName>& robots, std::int64_t now_s) const {
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const auto& [id, name] = robots[i];
    if (!is_folder_name(name) || name == kAuthorityFolder)
      throw ConfigError("robot name \"" + name +
                        "\": names a folder, so it is made of letters, digits, _, - and ., "
                        "and not \"authority\"");
    for (std::size_t j = 0; j < i; ++j)
      if (robots[j].id == id || robots[j].name == name)
        throw ConfigError(describe(id, name) + " and " + describe(robots[j].id, robots[j].name) +
                          ": ids and names are unique in a team");
    for (const Certificate& other : issued_)
      if ((other.robot == id || other.name == name) &&
          why_invalid(other, revocations_, now_s) == nullptr)
        throw std::runtime_error(describe(id, name) + ": " + describe(other.robot, other.name) +
                                 " has a certificate until " + time_text(other.valid_until_s) +
                                 "; revoke it first");
  }
}

void TeamFolder::issue(const std::vector<RobotName>& robots, std::int64_t now_s,
                       std::int64_t valid_until_s) {
  check(robots, now_s);
  for (const RobotName& robot : robots) issue_one(robot, now_s, valid_until_s);
  sort_issued();
}

void TeamFolder::issue_one(const RobotName& robot, std::int64_t now_s, std::int64_t valid_until_s) {
  const SigningKey secret = make_signing_key();
  Certificate certificate{.team = authority_.team,
                          .robot = robot.id,
                          .name = robot.name,
                          .key = public_key_of(secret),
                          .valid_from_s = now_s - kClockTolerance_s,
                          .valid_until_s = valid_until_s};
  sign(certificate, secret_);
  // Writes the copy in issued/ first: a certificate without this copy could not be revoked.
  write_certificate(folder_ / kAuthorityFolder / kIssuedFolder /
                        (robot.name + '-' + fingerprint_of(certificate.key) + ".txt"),
                    certificate);
  const fs::path own = folder_ / robot.name;
  make_private_folder(own);
  write_secret_key(own / kSecretKeyFile, secret,
                   "robot " + describe(robot.id, robot.name) + " of team " + authority_.team);
  write_certificate(own / kCertificateFile, certificate);
  write_authority(own / kAuthorityFile, authority_);
  write_revocations(own / kRevocationsFile, revocations_);
  issued_.push_back(certificate);
}

std::vector<RevokedCertificate> TeamFolder::revoke(const std::string& robot) {
  std::vector<RevokedCertificate> fresh;
  bool known = false;
  const bool is_name = std::ranges::find(issued_, robot, &Certificate::name) != issued_.end();
  for (const Certificate& one : issued_) {
    if ((is_name ? one.name : std::to_string(one.robot)) != robot) continue;
    known = true;
    const RevokedCertificate revoked{one.key, one.robot, one.name};
    if (std::ranges::find(revocations_.revoked, revoked) == revocations_.revoked.end())
      fresh.push_back(revoked);
  }
  if (fresh.empty())
    throw std::runtime_error("robot \"" + robot + "\": " +
                             (known ? "is revoked already"
                                    : "this team never had one of this name or id; "
                                      "`kimera_multi_keys show` lists them"));
  revocations_.number += 1;
  revocations_.revoked.insert(revocations_.revoked.end(), fresh.begin(), fresh.end());
  sign(revocations_, secret_);
  write_revocations(folder_ / kAuthorityFolder / kRevocationsFile, revocations_);
  for (const Certificate& one : issued_)
    if (const fs::path own = folder_ / one.name; fs::is_directory(own))
      write_revocations(own / kRevocationsFile, revocations_);
  return fresh;
}

}  // namespace km

#include <exception>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "apps/keys/commands.hpp"
#include "modules/core/text_table.hpp"
#include "modules/security/key_file.hpp"
#include "modules/security/key_folder.hpp"
#include "modules/security/team_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

using Rows = std::vector<std::vector<std::string>>;

Rows header() {
  return {{"robot", "id", "key", "valid from", "until", "state"}};
}

std::vector<std::string> row_of(const Certificate& certificate, const Revocations& revocations) {
  const char* const reason = why_invalid(certificate, revocations, now_s());
  return {certificate.name,
          std::to_string(certificate.robot),
          fingerprint_of(certificate.key),
          time_text(certificate.valid_from_s),
          time_text(certificate.valid_until_s),
          reason == nullptr ? "holds" : reason};
}

// If the folder of a robot is on this host, prints that the user must delete this folder once the
// robot has it. Also prints if its list of revocations is old or the folder is unusable.
void report_folder(const fs::path& folder, const Revocations& revocations) {
  if (!fs::is_directory(folder)) return;
  try {
    const RobotKeys keys = load_robot_keys(folder);
    std::cout << folder.string() << ": here, with its secret: delete it once it is on the robot\n";
    if (keys.revocations.number < revocations.number)
      std::cout << folder.string() << ": its list of revocations is old\n";
  } catch (const std::exception& error) {
    std::cout << "unusable: " << error.what() << '\n';
  }
}

void show_team(const fs::path& folder) {
  const TeamFolder team(folder);
  std::cout << "team " << team.authority().team << ", authority "
            << fingerprint_of(team.authority().key) << ", list of revocations number "
            << team.revocations().number << '\n';
  Rows rows = header();
  std::vector<std::string> names;
  for (const Certificate& certificate : team.issued()) {
    rows.push_back(row_of(certificate, team.revocations()));
    if (names.empty() || names.back() != certificate.name) names.push_back(certificate.name);
  }
  std::cout << align_columns(rows);
  for (const std::string& name : names) report_folder(folder / name, team.revocations());
}

void show_robot(const fs::path& folder) {
  const RobotKeys keys = load_robot_keys(folder);
  std::cout << "team " << keys.certificate.team << ", authority " << fingerprint_of(keys.authority)
            << ", list of revocations number " << keys.revocations.number << '\n';
  Rows rows = header();
  rows.push_back(row_of(keys.certificate, keys.revocations));
  std::cout << align_columns(rows);
  for (const RevokedCertificate& one : keys.revocations.revoked)
    std::cout << "revoked: " << one.name << " (id " << one.robot << "), key "
              << fingerprint_of(one.key) << '\n';
}

}  // namespace

void add_show(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "show",
      R"(Check and show the keys of a team, or of one robot, without the secrets.
  kimera_multi_keys show survey
  kimera_multi_keys show keys          # on the robot)");
  const auto folder = std::make_shared<fs::path>();
  app.add_option("FOLDER", *folder, "Folder of a team, or of a robot's keys")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.callback([folder] {
    if (fs::exists(*folder / kCertificateFile))
      show_robot(*folder);
    else
      show_team(*folder);
  });
}

}  // namespace km

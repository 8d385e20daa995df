#include <charconv>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "apps/program_options.hpp"
#include "modules/core/text_table.hpp"
#include "modules/security/key_file.hpp"
#include "modules/security/key_folder.hpp"
#include "modules/security/team_folder.hpp"

namespace km {
namespace {

constexpr const char* kAbout =
    R"(Keys of a team. The team's authority gives each robot a key and a certificate. Robots that are
started with them (--security) accept messages of each other only, and no other program can read
these messages. Examples:
  kimera_multi_keys make survey --robots alpha:0,beta:1   # name:id of each robot
  scp -rp survey/alpha alpha.local:keys                   # copy its folder onto the robot
  kimera_multi_keys add survey --robots gamma:2           # later, one more
  kimera_multi_keys revoke survey beta                    # beta is lost
  kimera_multi_keys show survey
Keep survey/authority off the robots, and a copy of it in a safe place: its owner can admit
any robot to the team, and without it no robot can be added or revoked.
Every subcommand has a --help. Exit code: 0 for success, 1 otherwise.)";

namespace fs = std::filesystem;

constexpr std::int64_t kDay_s = 86400;

// [s since 1970-01-01 UTC]
std::int64_t now_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

struct KeysCommand {
  fs::path team;
  std::vector<std::string> robots;  // "name:id" of each robot, or only the number of robots
  int days = 365;
  std::string revoked;
};

std::optional<RobotId> robot_id_from(std::string_view text) {
  RobotId id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return id;
}

std::vector<RobotName> robots_from(const std::vector<std::string>& texts) {
  std::vector<RobotName> robots;
  if (const auto count = robot_id_from(texts.front()); texts.size() == 1 && count) {
    for (RobotId id = 0; id < *count; ++id) robots.push_back({id, "robot" + std::to_string(id)});
    if (robots.empty()) throw std::runtime_error("--robots 0: a team has at least one robot");
    return robots;
  }
  for (const std::string& text : texts) {
    const std::size_t colon = text.find(':');
    const auto id = colon == std::string::npos
                        ? std::nullopt
                        : robot_id_from(std::string_view(text).substr(colon + 1));
    if (!id)
      throw std::runtime_error("--robots: \"" + text +
                               "\" is not name:id, with an id from 0 to 65535, such as alpha:0");
    robots.push_back({*id, text.substr(0, colon)});
  }
  return robots;
}

void print_issued(const KeysCommand& command, const std::vector<RobotName>& robots) {
  for (const RobotName& robot : robots)
    std::cout << (command.team / robot.name).string() << "  for robot " << robot.id << ", valid "
              << command.days << " days\n";
  std::cout << R"(Copy each folder onto its robot, keeping modes (scp -rp), and start the robot with
  --robot ID --name NAME --security FOLDER
then delete it here. )"
            << (command.team / "authority").string()
            << " stays here: whoever has it can admit anyone.\n";
}

void make_or_add(const KeysCommand& command, bool is_new) {
  const auto robots = robots_from(command.robots);
  const std::int64_t now = now_s(), until = now + command.days * kDay_s;
  if (is_new)
    TeamFolder::make(command.team, robots, now, until);
  else
    TeamFolder(command.team).issue(robots, now, until);
  print_issued(command, robots);
}

void print_revoked(std::span<const RevokedCertificate> revoked) {
  for (const RevokedCertificate& one : revoked)
    std::cout << "revoked: " << one.name << " (id " << one.robot << "), key "
              << fingerprint_of(one.key) << '\n';
}

void revoke(const KeysCommand& command) {
  TeamFolder team(command.team);
  print_revoked(team.revoke(command.revoked));
  std::cout << "A robot refuses it once it has the new list: copy "
            << (command.team / "authority" / kRevocationsFile).string()
            << "\ninto the folder of keys on every robot that stays.\n";
}

void define_robots(CLI::App& app, KeysCommand& command) {
  app.add_option("TEAM", command.team, "Folder of the team")->required();
  app.add_option("--robots", command.robots,
                 "name:id of each robot, separated by commas, as in --name and --robot of the "
                 "robots; or the number of robots, which are named robot0, robot1, ...")
      ->required()
      ->delimiter(',');
  app.add_option(
         "--days", command.days,
         "Validity of the certificates. They are valid from the day before, for clocks that "
         "are late; a robot without a clock needs the time before it starts")
      ->check(CLI::Range(1, 36500))
      ->capture_default_str();
}

void print_certificates(std::span<const Certificate> certificates, const std::string& team,
                        const PublicKey& authority, const Revocations& revocations) {
  std::cout << "team " << team << ", authority " << fingerprint_of(authority)
            << ", list of revocations number " << revocations.number << '\n';
  std::vector<std::vector<std::string>> rows = {
      {"robot", "id", "key", "valid from", "until", "state"}};
  for (const Certificate& one : certificates) {
    const char* const reason = why_invalid(one, revocations, now_s());
    rows.push_back({one.name, std::to_string(one.robot), fingerprint_of(one.key),
                    time_text(one.valid_from_s), time_text(one.valid_until_s),
                    reason == nullptr ? "holds" : reason});
  }
  std::cout << align_columns(rows);
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
  print_certificates(team.issued(), team.authority().team, team.authority().key,
                     team.revocations());
  std::set<std::string> names;
  for (const Certificate& certificate : team.issued()) names.insert(certificate.name);
  for (const std::string& name : names) report_folder(folder / name, team.revocations());
}

void show_robot(const fs::path& folder) {
  const RobotKeys keys = load_robot_keys(folder);
  print_certificates({&keys.certificate, 1}, keys.certificate.team, keys.authority,
                     keys.revocations);
  print_revoked(keys.revocations.revoked);
}

void add_make(CLI::App& parent) {
  CLI::App& app =
      *parent.add_subcommand("make",
                             R"(Make a team: its authority, and a folder of keys for each robot.
  kimera_multi_keys make survey --robots alpha:0,beta:1
  kimera_multi_keys make survey --robots 3 --days 30)");
  const auto command = std::make_shared<KeysCommand>();
  define_robots(app, *command);
  app.callback([command] { make_or_add(*command, true); });
}

void add_add(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "add",
      R"(Add robots to a team, or renew a certificate that is revoked or has expired. Running robots
accept the new keys: nothing has to be copied to them.
  kimera_multi_keys add survey --robots gamma:2)");
  const auto command = std::make_shared<KeysCommand>();
  define_robots(app, *command);
  app.callback([command] { make_or_add(*command, false); });
}

void add_revoke(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "revoke",
      R"(Revoke a robot's certificates, for a robot that is lost or whose secret was read. Copy the new
list of revocations to the other robots: until then they still accept the robot.
  kimera_multi_keys revoke survey beta)");
  const auto command = std::make_shared<KeysCommand>();
  app.add_option("TEAM", command->team, "Folder of the team")->required();
  app.add_option("ROBOT", command->revoked, "Name or id of the robot")->required();
  app.callback([command] { revoke(*command); });
}

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

}  // namespace
}  // namespace km

int main(int argc, char** argv) {
  return km::run_subcommands("kimera_multi_keys", km::kAbout,
                             {km::add_make, km::add_add, km::add_revoke, km::add_show}, argc, argv);
}

#include "apps/keys/commands.hpp"

#include <charconv>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "modules/security/key_file.hpp"
#include "modules/security/team_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kDay_s = 86400;

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

void make(const KeysCommand& command) {
  const auto robots = robots_from(command.robots);
  const std::int64_t now = now_s();
  TeamFolder::make(command.team, robots, now, now + command.days * kDay_s);
  print_issued(command, robots);
}

void add(const KeysCommand& command) {
  const auto robots = robots_from(command.robots);
  const std::int64_t now = now_s();
  TeamFolder(command.team).issue(robots, now, now + command.days * kDay_s);
  print_issued(command, robots);
}

void revoke(const KeysCommand& command) {
  TeamFolder team(command.team);
  for (const RevokedCertificate& one : team.revoke(command.revoked))
    std::cout << "revoked: " << one.name << " (id " << one.robot << "), key "
              << fingerprint_of(one.key) << '\n';
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

}  // namespace

std::int64_t now_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void add_make(CLI::App& parent) {
  CLI::App& app =
      *parent.add_subcommand("make",
                             R"(Make a team: its authority, and a folder of keys for each robot.
  kimera_multi_keys make survey --robots alpha:0,beta:1
  kimera_multi_keys make survey --robots 3 --days 30)");
  const auto command = std::make_shared<KeysCommand>();
  define_robots(app, *command);
  app.callback([command] { make(*command); });
}

void add_add(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "add",
      R"(Add robots to a team, or renew a certificate that is revoked or has expired. Running robots
accept the new keys: nothing has to be copied to them.
  kimera_multi_keys add survey --robots gamma:2)");
  const auto command = std::make_shared<KeysCommand>();
  define_robots(app, *command);
  app.callback([command] { add(*command); });
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

}  // namespace km

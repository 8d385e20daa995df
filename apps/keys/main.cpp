#include <charconv>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iostream>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "apps/program_options.hpp"
#include "modules/core/config.hpp"
#include "modules/core/io/text_table.hpp"
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
Every subcommand has a --help. Exit code: 0 for success, 2 for a bad command line, 1 otherwise.)";

namespace fs = std::filesystem;

constexpr std::int64_t kDay_s = 86400;

// [s since 1970-01-01 UTC]
std::int64_t now_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

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
    if (robots.empty()) throw ConfigError("a team has at least one robot");
    return robots;
  }
  for (const std::string& text : texts) {
    const std::size_t colon = text.find(':');
    const auto id = colon == std::string::npos
                        ? std::nullopt
                        : robot_id_from(std::string_view(text).substr(colon + 1));
    if (!id)
      throw ConfigError("\"" + text +
                        "\" is not name:id, with an id from 0 to 65535, such as alpha:0");
    robots.push_back({*id, text.substr(0, colon)});
  }
  return robots;
}

// Adds robots to a team, which is made first if `kIsNew`.
template <bool kIsNew>
struct IssueCommand {
  fs::path team;
  std::vector<std::string> names;  // "name:id" of each robot, or only the number of robots
  int days = 365;

  void define(CLI::App& app) {
    app.add_option("TEAM", team, "Folder of the team")->required();
    app.add_option("--robots", names,
                   "name:id of each robot, separated by commas, as in --name and --robot of the "
                   "robots; or the number of robots, which are named robot0, robot1, ...")
        ->required()
        ->delimiter(',');
    app.add_option(
           "--days", days,
           "Validity of the certificates. They are valid from the day before, for clocks that "
           "are late; a robot without a clock needs the time before it starts")
        ->check(CLI::Range(1, 36500))
        ->capture_default_str();
  }

  void run() const try {
    const auto robots = robots_from(names);
    const std::int64_t now = now_s(), until = now + days * kDay_s;
    if (kIsNew)
      TeamFolder::make(team, robots, now, until);
    else
      TeamFolder(team).issue(robots, now, until);
    for (const RobotName& robot : robots)
      std::cout << (team / robot.name).string() << "  for robot " << robot.id << ", valid " << days
                << " days\n";
    std::cout
        << R"(Copy each folder onto its robot, keeping modes (scp -rp), and start the robot with
  --robot ID --name NAME --security FOLDER
then delete it here. )"
        << (team / kAuthorityFolder).string() << " stays here: whoever has it can admit anyone.\n";
  } catch (const ConfigError& error) {
    throw CLI::ValidationError("--robots", error.what());
  }
};

void print_revoked(std::span<const RevokedCertificate> revoked) {
  for (const RevokedCertificate& one : revoked)
    std::cout << "revoked: " << one.name << " (id " << one.robot << "), key "
              << fingerprint_of(one.key) << '\n';
}

struct RevokeCommand {
  fs::path team;
  std::string robot;

  void define(CLI::App& app) {
    app.add_option("TEAM", team, "Folder of the team")->required();
    app.add_option("ROBOT", robot, "Name or id of the robot")->required();
  }

  void run() const {
    print_revoked(TeamFolder(team).revoke(robot));
    std::cout << "A robot refuses it once it has the new list: copy "
              << (team / kAuthorityFolder / kRevocationsFile).string()
              << "\ninto the folder of keys on every robot that stays.\n";
  }
};

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
// robot has it. Also prints if its list of revocations is old. False if the folder is unusable.
bool report_folder(const fs::path& folder, const Revocations& revocations) {
  if (!fs::is_directory(folder)) return true;
  try {
    const RobotKeys keys = load_robot_keys(folder);
    std::cout << folder.string() << ": here, with its secret: delete it once it is on the robot\n";
    if (keys.revocations.number < revocations.number)
      std::cout << folder.string() << ": its list of revocations is old\n";
    return true;
  } catch (const std::exception& error) {
    std::cout << "unusable: " << error.what() << '\n';
    return false;
  }
}

struct ShowCommand {
  fs::path folder;

  void define(CLI::App& app) {
    app.add_option("FOLDER", folder, "Folder of a team, or of a robot's keys")->required();
  }

  void run() const { fs::exists(folder / kCertificateFile) ? show_robot() : show_team(); }

 private:
  void show_team() const {
    const TeamFolder team(folder);
    print_certificates(team.issued(), team.authority().team, team.authority().key,
                       team.revocations());
    std::set<std::string> names;
    for (const Certificate& certificate : team.issued()) names.insert(certificate.name);
    bool are_usable = true;
    for (const std::string& name : names)
      are_usable &= report_folder(folder / name, team.revocations());
    if (!are_usable)
      throw std::runtime_error(folder.string() + ": has unusable folders, see above");
  }

  void show_robot() const {
    const RobotKeys keys = load_robot_keys(folder);
    print_certificates({&keys.certificate, 1}, keys.certificate.team, keys.authority,
                       keys.revocations);
    print_revoked(keys.revocations.revoked);
  }
};

void add_make(CLI::App& app) {
  add_command<IssueCommand<true>>(
      app, "make",
      R"(Make a team: its authority, and a folder of keys for each robot.
  kimera_multi_keys make survey --robots alpha:0,beta:1
  kimera_multi_keys make survey --robots 3 --days 30)");
}

void add_add(CLI::App& app) {
  add_command<IssueCommand<false>>(
      app, "add",
      R"(Add robots to a team, or renew a certificate that is revoked or has expired.
Running robots accept the new keys: nothing has to be copied to them.
  kimera_multi_keys add survey --robots gamma:2)");
}

void add_revoke(CLI::App& app) {
  add_command<RevokeCommand>(
      app, "revoke",
      R"(Revoke a robot's certificates, for a robot that is lost or whose secret was read.
Copy the new list of revocations to the other robots: until then they still accept the robot.
  kimera_multi_keys revoke survey beta)");
}

void add_show(CLI::App& app) {
  add_command<ShowCommand>(
      app, "show",
      R"(Check and show the keys of a team, or of one robot, without the secrets.
  kimera_multi_keys show survey
  kimera_multi_keys show keys          # on the robot)");
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) {
  return km::run_subcommands("kimera_multi_keys", km::kAbout,
                             {km::add_make, km::add_add, km::add_revoke, km::add_show}, argc, argv);
}

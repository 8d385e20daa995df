#include "modules/security/key_folder.hpp"
#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

struct Shell {
  [[nodiscard]] CommandResult operator()(const std::string& arguments) const {
    return run_command("cd " + folder.path().string() + " && " KM_BIN_DIR "/kimera_multi_keys " +
                       arguments);
  }
  TemporaryFolder folder;
};

TEST_CASE("kimera_multi_keys makes a team whose robots' folders can be used") {
  const Shell keys;
  const auto made = succeeded(keys("make survey --robots alpha:0,beta:12"));
  CHECK_THAT(made.output, Contains("survey/beta  for robot 12, valid 365 days") &&
                              Contains("whoever has it can admit anyone"));
  const RobotKeys beta = load_robot_keys(keys.folder.path() / "survey" / "beta");
  CHECK(beta.certificate.robot == 12);
  const auto now_s = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  CHECK(why_refused(beta.certificate, beta.authority, beta.revocations, now_s) == nullptr);
}

TEST_CASE("kimera_multi_keys names a number of robots as other programs do") {
  const Shell keys;
  REQUIRE(keys("make survey --robots 3 --days 30").exit_code == 0);
  for (const char* name : {"robot0", "robot1", "robot2"})
    CHECK(load_robot_keys(keys.folder.path() / "survey" / name).certificate.name == name);
  CHECK_FALSE(fs::exists(keys.folder.path() / "survey" / "robot3"));
}

TEST_CASE("kimera_multi_keys adds, revokes and shows robots") {
  const Shell keys;
  REQUIRE(keys("make survey --robots alpha:0,beta:1").exit_code == 0);
  REQUIRE(keys("add survey --robots gamma:2").exit_code == 0);
  const auto revoked = keys("revoke survey beta");
  CHECK(revoked.exit_code == 0);
  CHECK_THAT(revoked.output,
             Contains("revoked: beta (id 1)") && Contains("copy survey/authority/revocations.txt"));
  const auto shown = succeeded(keys("show survey"));
  CHECK_THAT(shown.output,
             Contains("alpha") && Contains("gamma") && Contains("certificate is revoked"));
  const std::string secret = keys.folder.read("survey/alpha/secret_key.txt");
  CHECK_THAT(shown.output, !Contains(secret.substr(secret.find("secret_key: ") + 12, 64)));
  CHECK_THAT(keys("show survey/gamma").output,
             Contains("holds") && Contains("revoked: beta (id 1)"));
}

TEST_CASE("kimera_multi_keys shows what is wrong with a robot's folder") {
  const Shell keys;
  REQUIRE(keys("make survey --robots alpha:0").exit_code == 0);
  fs::permissions(keys.folder.path() / "survey/alpha/secret_key.txt", fs::perms::others_read,
                  fs::perm_options::add);
  const auto team = keys("show survey");
  CHECK(team.exit_code == 1);
  CHECK_THAT(team.output, Contains("unusable: survey/alpha/secret_key.txt: has mode 0604"));
  CHECK(keys("show survey/alpha").exit_code == 1);
}

TEST_CASE("kimera_multi_keys ends with the reason if it fails") {
  const Shell keys;
  REQUIRE(keys("make survey --robots alpha:0").exit_code == 0);
  const auto [arguments, reason] = GENERATE(table<std::string, std::string>({
      {"make survey --robots beta:1", "is there already"},
      {"make other --robots beta", "\"beta\" is not name:id"},
      {"make other --robots beta:65536", "\"beta:65536\" is not name:id"},
      {"make other --robots 0", "at least one robot"},
      {"make other --robots beta:1,beta:2", "unique in a team"},
      {"make other --robots 'a b:1'", "made of letters"},
      {"add survey --robots beta:0", "revoke it first"},
      {"add nowhere --robots beta:0", "nowhere/authority/authority.txt: no such file"},
      {"revoke survey delta", "never had one of this name or id"},
      {"", "subcommand is required"},
  }));
  CAPTURE(arguments);
  const CommandResult result = keys(arguments);
  CHECK(is_refused(result));
  CHECK_THAT(result.output, Contains(reason, Catch::CaseSensitive::No));
  CHECK_FALSE(fs::exists(keys.folder.path() / "other"));
}

TEST_CASE("Every subcommand of kimera_multi_keys has a help with an example") {
  const Shell keys;
  CHECK(keys("--help").exit_code == 0);
  for (const std::string command : {"make", "add", "revoke", "show"}) {
    CAPTURE(command);
    const auto help = keys(command + " --help");
    CHECK(help.exit_code == 0);
    CHECK_THAT(help.output, Contains("  kimera_multi_keys " + command + " "));
  }
}

}  // namespace
}  // namespace km

#include <nlohmann/json.hpp>

#include "apps/robot/run_summary.hpp"
#include "apps/team/run_team.hpp"
#include "test/support/command.hpp"
#include "test/support/own_networks.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

// kimera_multi_team as a program, with a shell script in the robots' place.

namespace km {
namespace {

RunSummary finished_summary() {
  RunSummary summary;
  summary.frames = 77;
  summary.exit_reason = "finished";
  return summary;
}

// Finds its name and output folder on its command line, prints a status line and leaves a summary.
// `end` is its last command.
std::string robot_script(const std::string& end) {
  return "#!/bin/sh\n"
         "all=\"$*\"\n"
         "while [ $# -gt 0 ]; do\n"
         "  case $1 in --name) name=$2; shift ;; --output) out=$2; shift ;; esac\n"
         "  shift\n"
         "done\n"
         "echo \"status of $name: $all\"\n"
         "cp \"${0%robot}summary.json\" \"$out\"\n" +
         end + '\n';
}

struct ScriptedTeam {
  TemporaryFolder folder;
  std::string command;

  explicit ScriptedTeam(const std::string& end) {
    const fs::path script = folder.write("robot", robot_script(end));
    fs::permissions(script, fs::perms::owner_all);
    folder.write("summary.json", json_text(finished_summary()));
    folder.write("g.csv", "");
    const fs::path file = folder.write("team.yaml",
                                       "robots:\n"
                                       "  - {id: 1, name: alice, graph: g.csv}\n"
                                       "  - {id: 2, name: bob, graph: g.csv}\n");
    command = std::string(KM_BIN_DIR) + "/kimera_multi_team --config " + file.string() +
              " --robot-binary " + script.string() + " --output " +
              (folder.path() / "out").string();
  }
};

}  // namespace

TEST_CASE("The time of the recording is read from the status line of a robot") {
  CHECK(recorded_s_of("7.4 s, 148 images, 21 keyframes | peers: none yet") == 7.4);
  for (const char* other : {"", "started", "pause of 7.4 s, done", " s, 3", "7.4 m, 2 s, 3"})
    CHECK_FALSE(recorded_s_of(other));
}

TEST_CASE("A team runs its robots, shows their lines and prints the table") {
  const ScriptedTeam team("exit 0");
  const std::string json = (team.folder.path() / "out/team.json").string();
  const auto result = succeeded(
      run_command(team.command + " --rate max --domain 5 --json " + json + " -- --set a.b=1"));
  CHECK_THAT(result.output, Contains("alice | status of alice: --robot 1 --name alice"));
  CHECK_THAT(result.output, Contains("--rate max --domain 5"));
  CHECK_THAT(result.output, Contains("--set a.b=1"));
  CHECK_THAT(result.output, Contains("bob   | status of bob"));
  CHECK_THAT(result.output, Contains("77") && Contains("finished"));
  CHECK_THAT(team.folder.read("out/team.json"), Contains("\"frames\": 77"));
  CHECK_THAT(team.folder.read("out/bob/robot.log"), Contains("status of bob"));
}

TEST_CASE("A robot that fails fails the team, with its last words") {
  const ScriptedTeam team(
      "[ $name = bob ] && { echo 'out of luck'; echo '  or of fuel'; } >&2 && exit 9; exit 0");
  const auto result = run_command(team.command);
  CAPTURE(result.output);
  CHECK(result.exit_code == 3);
  CHECK_THAT(result.output, Contains("bob   | FAILED: exit code 9, out of luck\n") &&
                                Contains("bob failed, exit code 9; its last words:") &&
                                Contains("  out of luck"));
}

TEST_CASE("A program that is no robot fails the team") {
  const ScriptedTeam team("exit 0");
  const std::string before = team.command.substr(0, team.command.find(" --robot-binary"));
  const auto result = run_command(before + " --robot-binary /bin/true --output " +
                                  (team.folder.path() / "out").string());
  CAPTURE(result.output);
  CHECK(result.exit_code == 3);
  CHECK_THAT(result.output, Contains("is /bin/true kimera_multi_robot?"));
}

TEST_CASE("Results of an earlier run are not shown for a robot that fails") {
  const ScriptedTeam team("[ $name = bob ] && { rm \"$out/summary.json\"; exit 1; }; exit 0");
  for (const char* file : {"summary.json", "optimized.tum", "exit_code"})
    team.folder.write(std::string("out/bob/") + file, "{\"frames\": 4711}");
  for (const char* file : {"out/team_mesh.ply", "out/label_palette.csv"})
    team.folder.write(file, "old");
  team.folder.write("out/bob/notes.txt", "of the user");
  const auto result = run_command(team.command);
  CAPTURE(result.output);
  CHECK(result.exit_code == 3);
  CHECK_THAT(result.output, Contains("in place of an earlier run's") && !Contains("4711"));
  CHECK_FALSE(fs::exists(team.folder.path() / "out/bob/optimized.tum"));
  CHECK_FALSE(fs::exists(team.folder.path() / "out/bob/exit_code"));
  for (const char* file : {"out/team_mesh.ply", "out/label_palette.csv"})
    CHECK_FALSE(fs::exists(team.folder.path() / file));
  CHECK(fs::exists(team.folder.path() / "out/bob/notes.txt"));
}

TEST_CASE("The domain is drawn once for the whole team") {
  const ScriptedTeam team("exit 0");
  const std::string output = run_command(team.command).output;
  CAPTURE(output);
  CHECK_THAT(output, !Contains("in place of"));
  const auto domain_after = [&](std::size_t at) {
    const std::string key = "--domain ";
    const std::size_t begin = output.find(key, at) + key.size();
    return output.substr(begin, output.find(' ', begin) - begin);
  };
  CHECK(domain_after(output.find("status of alice")) == domain_after(output.find("status of bob")));
}

TEST_CASE("An interrupt is passed on once and the table still printed") {
  const ScriptedTeam team(
      "trap 'echo \"$name interrupted\"; exit 0' INT\n"
      "touch \"$out/ready\"\n"
      "while [ $name = alice ] && [ ! -e \"$out/../bob/ready\" ]; do :; done\n"
      "[ $name = alice ] && kill -INT $PPID\n"
      "while :; do sleep 0.05; done");
  const auto result = succeeded(run_command("exec " + team.command));
  CHECK_THAT(result.output, Contains("alice interrupted") && Contains("bob   | bob interrupted"));
  CHECK_THAT(result.output, Contains("team, one frame"));
}

TEST_CASE("With bad links each robot is in a network of its own") {
  const ScriptedTeam team(
      "echo $name has $(grep -o '10[.]77[.]0[.][1-9]' /proc/net/fib_trie | sort -u) on "
      "$(grep : /proc/net/dev | cut -d: -f1)");
  const std::string links = team.folder.write("links.yaml", "loss: 0.5\n").string();
  const auto result = run_command(team.command + " --links " + links);
  if (!had_own_networks(result.output)) return;
  CAPTURE(result.output);
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.output, Contains("alice has 10.77.0.1 on lo eth0\n") &&
                                Contains("bob has 10.77.0.2 on lo eth0\n"));
  const std::string table = team.folder.read("out/links.csv");
  CHECK_THAT(table, StartsWith("from,to,frames_in,") && Contains("\nalice,bob,") &&
                        Contains("\nbob,alice,"));
}

TEST_CASE("A robot whose interface is down loses frames and nothing else") {
  const ScriptedTeam team(
      "cd \"$out/..\"\n"
      "if [ $name = alice ]; then\n"
      "  ip link set eth0 down; touch down; while [ ! -e sent ]; do sleep 0.05; done\n"
      "else\n"
      "  while [ ! -e down ]; do sleep 0.05; done\n"
      "  bash -c 'echo anybody > /dev/udp/10.77.0.1/9'; sleep 0.3; touch sent\n"  // asks by ARP
      "fi");
  const std::string links = team.folder.write("links.yaml", "").string();
  const auto result = run_command(team.command + " --links " + links);
  if (!had_own_networks(result.output)) return;
  CAPTURE(result.output);
  CHECK(result.exit_code == 0);
  const std::string table = team.folder.read("out/links.csv");
  CHECK_THAT(table, Contains("\nbob,alice,") && !Contains("\nbob,alice,0,"));
}

TEST_CASE("Networks of robots vanish with their team, however it ends") {
  const int signal = GENERATE(0, SIGINT, SIGKILL);
  CAPTURE(signal);
  const ScriptedTeam team(
      "readlink /proc/self/ns/net > \"$out/network.new\"\n"
      "mv \"$out/network.new\" \"$out/network\"\n" +
      std::string(signal == 0 ? "exit 0" : "trap 'exit 0' INT; while :; do sleep 0.05; done"));
  const fs::path links = team.folder.write("links.yaml", "");
  sigset_t none;
  sigemptyset(&none);
  RobotProcess program({"/bin/sh", "-c", "exec " + team.command + " --links " + links.string()},
                       none, team.folder.path() / "log");
  const fs::path network = team.folder.path() / "out/bob/network";
  while (!fs::exists(network) && !program.exit()) program.read();
  if (signal != 0) program.send(signal);
  while (!program.exit()) program.read();
  if (!had_own_networks(team.folder.read("log"))) return;
  REQUIRE(fs::exists(network));
  const std::string name = team.folder.read("out/bob/network");
  const auto is_used = [&name] {  // by any process
    for (const auto& process : fs::directory_iterator("/proc")) {
      std::error_code error;
      const fs::path used = fs::read_symlink(process.path() / "ns/net", error);
      if (!error && used.string() + '\n' == name) return true;
    }
    return false;
  };
  while (is_used()) std::this_thread::yield();  // fails by the time limit of the test
  CHECK(fs::exists(team.folder.path() / "out/links.csv") == (signal != SIGKILL));
}

TEST_CASE("If networks are not allowed, a team with bad links does not start") {
  const ScriptedTeam team("echo started");
  const std::string links = team.folder.write("links.yaml", "").string();
  const std::string forbid =
      "unshare --user --map-root-user sh -c "
      "'echo 0 > /proc/sys/user/max_net_namespaces && exec ";
  if (run_command(forbid + "true'").exit_code != 0) {
    std::cout << "SKIPPED: needs user namespaces, to forbid networks in one\n";
    return;
  }
  const auto result = run_command(forbid + team.command + " --links " + links + '\'');
  CAPTURE(result.output);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output,
             StartsWith("kimera_multi_team: robots cannot have networks of their own here ("
                        "a network namespace: ") &&
                 Contains("/dev/net/tun"));
  CHECK_THAT(result.output, !Contains("started"));
}

TEST_CASE("How a robot ended elsewhere is read from its folder") {
  const TemporaryFolder folder;
  const std::string summary = json_text(finished_summary());
  folder.write("done/summary.json", summary);
  folder.write("failed/summary.json", summary);
  folder.write("failed/exit_code", "3\n");
  folder.write("torn/exit_code", "");
  std::string log;
  for (int i = 0; i < 30; ++i) log += "line " + std::to_string(i) + '\n';
  folder.write("failed/robot.log", log);

  TeamPlan plan;
  plan.output = folder.path();
  for (const char* name : {"done", "failed", "torn", "absent"})
    plan.robots.emplace_back().name = name;
  const auto runs = finished_runs(plan);
  REQUIRE(runs.size() == 4);
  CHECK(runs[0].exit.ok());
  CHECK(runs[0].last_log_lines.empty());
  CHECK(runs[1].exit.code == 3);
  REQUIRE(runs[1].last_log_lines.size() == 10);
  CHECK(runs[1].last_log_lines.front() == "line 20");
  CHECK(runs[1].last_log_lines.back() == "line 29");
  CHECK(runs[2].exit.code == 1);
  CHECK(runs[3].exit.code == 1);
}

TEST_CASE("A report starts no robot and fails if one of the run did") {
  const ScriptedTeam team("exit 0");
  const std::string command = team.command + " --report";
  team.folder.write("out/alice/summary.json", json_text(finished_summary()));
  const CommandResult half = run_command(command);
  CAPTURE(half.output);
  CHECK(half.exit_code == 3);
  CHECK_THAT(half.output, Contains("bob failed"));

  team.folder.write("out/bob/summary.json", json_text(finished_summary()));
  const CommandResult whole = succeeded(run_command(command));
  CHECK_THAT(whole.output,
             Contains("finished") && !Contains("DDS domain") && !Contains("status of"));
}

TEST_CASE("Input that cannot be run is refused") {
  const ScriptedTeam team("exit 0");
  const std::string tool = KM_BIN_DIR "/kimera_multi_team";
  const std::string elsewhere = team.command.substr(0, team.command.find(" --output"));
  const std::vector<std::pair<std::string, std::string>> refused = {
      {team.command + " --report",
       "out: no such folder\n"},  // first: the next one makes the folder
      {elsewhere.substr(0, elsewhere.find(" --robot-binary")) +
           " --robot-binary /nowhere/robot --output " + (team.folder.path() / "out").string(),
       "no such program"},
      {team.command + " --rate fast", "fast is neither a positive number nor max"},
      {team.command + " --set a.b=1", "Options of the robots come after --"},
      {elsewhere + " --output /proc/none", "/proc/none: cannot be"},
      {elsewhere + " --json /none/team.json", "/none/team.json: cannot be"},
      {tool, "--config is required"}};
  for (const auto& [command, message] : refused) {
    const auto result = run_command(command);
    CAPTURE(command);
    CHECK(is_refused(result));
    CHECK_THAT(result.output, Contains(message) && !Contains("status of alice"));
  }
  CHECK(run_command(tool + " --help").exit_code == 0);
}

}  // namespace km

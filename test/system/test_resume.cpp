#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/journal/restored_run.hpp"
#include "modules/mesh/map_file.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"
#include "test/system/team_run.hpp"
#include "test/system/walk.hpp"

// Robots that are killed at any moment and resumed; finished runs that are joined.

namespace km {
namespace {

struct Part {
  int robot = 0;
  std::string from_s;
  std::string to_s;
};

// Two parts of the recording that see the same places.
const Part kFirst{0, "0", "12"};
const Part kSecond{1, "5", "17"};

// As fast as it can: at any other rate images are skipped on a busy machine.
std::vector<std::string> command_of(const Part& part, const fs::path& dataset, int domain) {
  return words_of(euroc_robot(part.robot,
                              "--dataset " + dataset.string() + " --from " + part.from_s +
                                  " --to " + part.to_s + " --rate max --serve-limit 100",
                              domain));
}

std::vector<std::string> with(std::vector<std::string> command, const std::string& option,
                              const fs::path& value) {
  command.insert(command.end(), {option, value.string()});
  return command;
}

// Number of kills of a robot; KM_KILLS increases it.
int kills() {
  const char* const wanted = std::getenv("KM_KILLS");
  return wanted == nullptr ? 3 : std::atoi(wanted);
}

std::uintmax_t size_of(const fs::path& file) {
  std::error_code none;
  const std::uintmax_t size = fs::file_size(file, none);
  return none ? 0 : size;
}

// True once the journal has grown by `bytes`; false if the process has ended its input before.
bool grows_by(const fs::path& folder, std::uintmax_t bytes) {
  const fs::path journal = folder / "run.journal";
  const std::uintmax_t goal = size_of(journal) + bytes;
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (size_of(journal) < goal) {
    if (fs::exists(folder / "summary.json") || std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

bool is_there_within(const fs::path& file, std::chrono::seconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!fs::exists(file) && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return fs::exists(file);
}

// Position error after alignment, of all estimates in one frame [m].
double error_m(const fs::path& dataset, const std::vector<fs::path>& estimates,
               const TemporaryFolder& folder) {
  std::string command =
      std::string(KM_BIN_DIR "/kimera_multi_evaluate trajectory --truth ") +
      (dataset / "mav0/state_groundtruth_estimate0/groundtruth_tum.txt").string() + " --json " +
      (folder.path() / "error.json").string() + " --estimate";
  for (const fs::path& estimate : estimates) command += ' ' + estimate.string();
  const CommandResult result = succeeded(run_command(command));
  return read_json(folder.path() / "error.json")["joint"]["position_m"]["rmse"].get<double>();
}

TEST_CASE("A robot that is killed again and again loses no image", "[resume]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const auto command = command_of(kFirst, *dataset, random_domain());
  {
    Process whole(with(command, "--output", folder.path() / "whole"));
    REQUIRE(whole.wait() == 0);
  }
  const std::uintmax_t journal = size_of(folder.path() / "whole/run.journal");
  const double whole_m = error_m(*dataset, {folder.path() / "whole/optimized.tum"}, folder);
  std::mt19937 rng(1);
  int killed = 0;
  for (int run = 0; killed < kills(); ++run) {
    CAPTURE(run, killed);
    const fs::path output = folder.path() / ("killed" + std::to_string(run));
    for (bool first = true; killed < kills(); first = false) {
      Process victim(with(command, first ? "--output" : "--resume", output));
      if (!grows_by(output, first ? 1 : rng() % (journal / 6))) break;  // the input has ended
      victim.kill(SIGKILL);
      victim.wait();
      ++killed;
    }
    Process last(with(command, "--resume", output));
    REQUIRE(last.wait() == 0);
    CHECK(line_count(output / "odometry.tum") == line_count(folder.path() / "whole/odometry.tum"));
    const double killed_m = error_m(*dataset, {output / "optimized.tum"}, folder);
    CAPTURE(whole_m, killed_m);
    // After each kill odometry begins again without the window before it. In 18 runs on a busy
    // machine the error was 4.0 to 6.4 mm, by the keyframes of the kills (4.0 to 4.1 mm for the
    // whole run). A pose that is lost or in another frame makes centimetres.
    CHECK(killed_m < 2.0 * whole_m);
  }
}

TEST_CASE("A run localises itself in a finished map, and another one extends it", "[resume]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const fs::path map = folder.path() / "map", localized = folder.path() / "localized",
                 extended = folder.path() / "extended";
  const int domain = random_domain();
  const auto later = command_of({0, "7", "13"}, *dataset, domain);
  REQUIRE(Process(with(command_of({0, "0", "6"}, *dataset, domain), "--output", map)).wait() == 0);
  const std::uintmax_t before = size_of(map / "run.journal");
  REQUIRE(Process(with(with(later, "--localize", map), "--output", localized)).wait() == 0);
  const RunSummary summary = read_summary(localized / "summary.json");
  REQUIRE(summary.localization);
  CHECK(summary.localization->localised);
  CHECK(2 * summary.localization->matched > summary.localization->compared);
  CHECK(size_of(map / "run.journal") == before);
  // Both are in one frame: 4 mm here.
  constexpr double kLargest_m = 0.015;
  CHECK(error_m(*dataset, {map / "optimized.tum", localized / "optimized.tum"}, folder) <
        kLargest_m);

  REQUIRE(Process(with(with(later, "--extend", map), "--output", extended)).wait() == 0);
  CHECK(line_count(extended / "optimized.tum") ==
        line_count(map / "optimized.tum") + line_count(localized / "optimized.tum"));
  CHECK(error_m(*dataset, {extended / "optimized.tum"}, folder) < kLargest_m);
}

TEST_CASE("A robot that is killed keeps its map, and continues it", "[resume]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "run", map = output / "run.map";
  auto command = command_of(kFirst, *dataset, random_domain());
  command.insert(command.end(), {"--set", "mapping.mode=metric"});
  {
    Process victim(with(command, "--output", output));
    REQUIRE(is_there_within(map, kPatience));
    victim.kill(SIGKILL);
    victim.wait();
  }
  const MapMesh before = read_map_file(map);
  REQUIRE(before.mesh.faces.size() > 100);
  KeyframeIndex last_seen = 0;
  for (const auto& [first, last] : before.seen_by) last_seen = std::max(last_seen, last);
  const bool lost = last_seen + 1 < restore_run(output / "run.journal").keyframes.size();
  CAPTURE(last_seen, lost);
  Process resumed(logged(with(command, "--resume", output)));
  CHECK(resumed.wait() == 0);
  const auto reports = [](const TimedLine& line) {
    return line.text.find("run.map: has the surface of the first ") != std::string::npos;
  };
  CHECK(std::ranges::any_of(resumed.lines(), reports) == lost);
  const MapMesh after = read_map_file(map);
  CHECK(after.mesh.faces.size() > before.mesh.faces.size() + 100);
  // Surface that is seen again, and better, may be replaced.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < after.ids.size() && after.ids[i] <= before.ids.back(); ++i) ++kept;
  CHECK(kept > before.ids.size() / 2);
  CHECK(fs::file_size(output / "mesh_optimized.ply") > 0);
}

// Its closures with other robots.
std::set<ClosureId> shared_closures(const G2oGraph& graph) {
  std::set<ClosureId> closures;
  for (const RelativePose& edge : graph.edges)
    if (edge.from.robot != edge.to.robot) closures.insert(closure_id(edge.from, edge.to));
  return closures;
}

// Two robots with keys. One of them finds all closures and decides which are inliers, so the other
// one has received all of its closures. They run until they are interrupted.
class SealedTeam {
 public:
  static constexpr std::size_t kClosures = kLap / 6;

  SealedTeam() { make_keys(keys(), "robot0:0,robot1:1"); }

  [[nodiscard]] fs::path output(RobotId robot) const { return folder_.path() / robot_name(robot); }

  std::unique_ptr<Process> start(RobotId robot, const std::string& output_option) const {
    const std::uint32_t last = robot == 0 ? kLap : 0;
    const fs::path graph = write_walk(kWalks.at(robot), kWalks.at(1 - robot), last,
                                      folder_.path() / (robot_name(robot) + ".g2o"));
    // They are joined by all closures or not at all.
    return std::make_unique<Process>(
        words_of(KM_BIN_DIR "/kimera_multi_robot --robot " + std::to_string(robot) + " --name " +
                 robot_name(robot) + " --security " + (keys() / robot_name(robot)).string() +
                 " --graph " + graph.string() + " --rate max " + output_option + ' ' +
                 output(robot).string() + " --domain " + std::to_string(domain_) +
                 " --set run.settle_s=600 --set pcm.selection=pcm --set pcm.min_inliers=" +
                 std::to_string(kClosures)));
  }

  // Checks that both robots have found these closures, and that the places where they meet are
  // within `bound_m` of each other. The measurements are exact.
  void check_meetings(double bound_m) const {
    std::map<RobotId, G2oGraph> graphs;
    std::map<KeyframeId, SE3> T_world;
    for (const RobotId robot : {RobotId{0}, RobotId{1}}) {
      graphs[robot] = read_g2o(output(robot) / "pose_graph.g2o");
      for (const G2oVertex& vertex : graphs[robot].vertices) T_world[vertex.id] = vertex.T_world_kf;
    }
    const std::set<ClosureId> closures = shared_closures(graphs[0]);
    CHECK(closures.size() == kClosures);
    CHECK(closures == shared_closures(graphs[1]));
    for (const ClosureId& id : closures)
      CHECK((T_world.at(id.from).translation() - T_world.at(id.to).translation()).norm() < bound_m);
  }

  // Waits until it reports that it optimises with the other one.
  static bool is_joint(Process& robot) {
    return robot
        .wait_until([](const auto& line) { return line.find(", with 1 |") != std::string::npos; })
        .has_value();
  }

  static int interrupt(Process& robot) {
    robot.kill(SIGINT);
    return robot.wait();
  }

 private:
  static constexpr std::array<Walk, 2> kWalks{Walk{0, 0}, Walk{1, 30}};

  [[nodiscard]] fs::path keys() const { return folder_.path() / "keys"; }

  TemporaryFolder folder_;
  const int domain_ = random_domain();
};

// A table whose first column only grows, with one line of names.
void check_grows(const fs::path& file) {
  CAPTURE(file);
  const std::string text = read_input_file(file);
  double last = 0.0;
  std::size_t headers = 0;
  const std::vector<TextRow> rows = split_rows(text);
  for (const TextRow& row : rows) {
    CHECK(row.fields.size() == rows.front().fields.size());
    const auto value = number_in(row, 0);
    headers += value ? 0 : 1;
    CHECK(value.value_or(last) >= last);
    last = value.value_or(last);
  }
  CHECK(headers == 1);
}

TEST_CASE("A robot with keys that is killed and taken up is in its team as before", "[resume]") {
  const SealedTeam team;
  const RobotId killed = GENERATE(RobotId{0}, RobotId{1});
  const RobotId other = 1 - killed;
  CAPTURE(killed);
  const auto survivor = team.start(other, "--output");
  {
    const auto victim = team.start(killed, "--output");
    REQUIRE(SealedTeam::is_joint(*victim));
    REQUIRE(SealedTeam::is_joint(*survivor));
    REQUIRE(is_there_within(team.output(killed) / "optimizer.csv", kPatience));
    victim->kill(SIGKILL);
    victim->wait();
  }
  const std::array growing{"process.csv", "traffic.csv", "optimizer.csv"};
  std::map<std::string, std::string> before;
  for (const std::string file : growing) before[file] = read_input_file(team.output(killed) / file);
  const auto resumed = team.start(killed, "--resume");
  REQUIRE(SealedTeam::is_joint(*resumed));
  CHECK(SealedTeam::interrupt(*resumed) == 0);
  for (const std::string file : growing) {
    const std::string whole = before[file].substr(0, before[file].rfind('\n') + 1);
    const std::string after = read_input_file(team.output(killed) / file);
    CHECK(after.starts_with(whole));
    CHECK(after.size() > whole.size());
    check_grows(team.output(killed) / file);
  }
  CHECK(SealedTeam::interrupt(*survivor) == 0);
  for (const RobotId robot : {killed, other})
    CHECK(read_summary(team.output(robot) / "summary.json").pgo.members ==
          std::vector<RobotId>{0, 1});
  team.check_meetings(1e-3);
}

// Waits until all keyframes are optimised again.
bool has_optimised(Process& robot) {
  return robot
      .wait_until([](const std::string& line) {
        return line.find(std::to_string(kLap) + " keyframes") != std::string::npos &&
               line.find("pgo: cost") != std::string::npos &&
               line.find("round 0,") == std::string::npos;
      })
      .has_value();
}

TEST_CASE("A robot that is killed and resumed without its team keeps what the team had found",
          "[resume]") {
  const SealedTeam team;
  {
    const auto other = team.start(0, "--output");
    const auto victim = team.start(1, "--output");
    REQUIRE(SealedTeam::is_joint(*victim));
    REQUIRE(SealedTeam::is_joint(*other));
    REQUIRE(has_optimised(*victim));
    REQUIRE(grows_by(team.output(1), 600));  // two samples: the solution is on the disk
    victim->kill(SIGKILL);
    victim->wait();
    CHECK(SealedTeam::interrupt(*other) == 0);
  }
  const auto resumed = team.start(1, "--resume");
  REQUIRE(has_optimised(*resumed));
  CHECK(SealedTeam::interrupt(*resumed) == 0);
  CHECK(read_summary(team.output(1) / "summary.json").pgo.anchor == RobotId{0});
  team.check_meetings(0.01);  // the bound of StatedPoses
}

TEST_CASE("A journal with flipped bytes is continued or replaced, and a copy is kept", "[resume]") {
  const bool is_session = GENERATE(false, true);
  CAPTURE(is_session);
  const TemporaryFolder folder;
  const fs::path graph = write_walk({0, 0}, {1, 30}, 0, folder.path() / "walk.g2o");
  const std::string output = (folder.path() / "run").string();
  const std::string command = KM_BIN_DIR "/kimera_multi_robot --robot 0 --rate max --graph " +
                              graph.string() + " --domain " + std::to_string(random_domain());
  REQUIRE(run_command(command + " --output " + output).exit_code == 0);
  std::string journal = folder.read("run/run.journal");
  journal[journal.size() / 2] ^= 1;
  folder.write("run/run.journal", journal);
  const auto results = folder.path() / (is_session ? "session" : "run");
  const std::string session =
      KM_BIN_DIR "/kimera_multi_robot --robot 0 --serve-limit 0 --session " + output +
      " --domain " + std::to_string(random_domain()) + " --output ";
  if (is_session) {  // the results would be lost
    const CommandResult onto_itself = run_command(session + output);
    CHECK(onto_itself.exit_code == 1);
    CHECK_THAT(onto_itself.output, Contains("is in the folder of --output"));
    CHECK(folder.read("run/run.journal") == journal);
  }
  const CommandResult again = succeeded(
      run_command(is_session ? session + results.string() : command + " --resume " + output));
  CHECK_THAT(again.output, Contains("run.journal: ") && Contains(" on are damaged and left out") &&
                               Contains("run.journal.damaged"));
  CHECK(folder.read("run/run.journal.damaged") == journal);
  CHECK(read_summary(results / "summary.json").keyframes == kLap);
}

TEST_CASE("A finished run is joined by another robot, and continued by its own robot only",
          "[resume]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const fs::path yesterday = folder.path() / "yesterday", today = folder.path() / "today";
  {
    Part first = kFirst;
    first.robot = 7;
    Process mapping(with(command_of(first, *dataset, random_domain()), "--output", yesterday));
    REQUIRE(mapping.wait() == 0);
  }
  fs::create_directory_symlink(fs::absolute(*dataset), folder.path() / "other");
  for (const auto& [robot, recording] :
       {std::pair(4, *dataset), std::pair(7, folder.path() / "other")}) {
    const CommandResult other =
        run_command(KM_BIN_DIR "/kimera_multi_robot --robot " + std::to_string(robot) +
                    " --resume " + yesterday.string() + " --dataset " + recording.string());
    CAPTURE(other.output);
    CHECK(other.exit_code == 1);
    CHECK_THAT(other.output, Contains("run.journal: is of robot 7 on MH_01_easy"));
  }
  const int domain = random_domain();
  const fs::path silent_output = folder.path() / "silent";
  Process silent(words_of(KM_BIN_DIR "/kimera_multi_robot --robot 0 --session " +
                          yesterday.string() + " --domain " + std::to_string(domain) +
                          " --output " + silent_output.string()));
  Process robot(with(command_of(kSecond, *dataset, domain), "--output", today));
  CHECK(robot.wait() == 0);
  CHECK(silent.wait() == 0);
  CHECK(read_summary(today / "summary.json").pgo.members == std::vector<RobotId>{0, 1});
  CHECK(read_summary(silent_output / "summary.json").keyframes ==
        read_summary(yesterday / "summary.json").keyframes);
  CHECK(error_m(*dataset, {silent_output / "optimized.tum", today / "optimized.tum"}, folder) <
        0.015);
}

}  // namespace
}  // namespace km

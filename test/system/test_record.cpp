#include <catch2/catch.hpp>

#include <csignal>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "modules/core/input_file.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/recordings/mcap_reader.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/modules/recordings/bag_contents.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/system/team_run.hpp"

// Records of robots and teams, read by our reader and by others.

namespace km {
namespace {

namespace fs = std::filesystem;

std::string robot_command(const fs::path& dataset, const fs::path& output,
                          const std::string& more) {
  return std::string(KM_BIN_DIR) +
         "/kimera_multi_robot --config config/datasets/euroc.yaml --robot 0 --name alice "
         "--dataset " +
         dataset.string() + " --to 12 --rate max --domain " + std::to_string(random_domain()) +
         " --output " + output.string() + " --record " + more;
}

struct Record {
  explicit Record(const fs::path& file) : reader(file), messages(told_by(reader)) {
    for (const ToldMessage& message : messages) ++counts[message.topic];
  }
  template <typename Message>
  [[nodiscard]] Message last(const std::string& topic) const {
    for (std::size_t k = messages.size(); k-- > 0;)
      if (messages[k].topic == topic)
        return decode_ros<Message>("cdr", messages[k].bytes).value.value();
    throw std::out_of_range(topic);
  }

  McapReader reader;
  std::vector<ToldMessage> messages;
  std::map<std::string, std::size_t> counts;
};

// Text has nine digits behind the point.
void check_equal(const RosPath& path, const std::vector<StampedPose>& poses) {
  constexpr double kDigits = 0.51e-9;
  REQUIRE(path.poses.size() == poses.size());
  double farthest_m = 0.0, most_turned = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    REQUIRE(path.poses[k].header.stamp == poses[k].stamp);
    const RosPose& pose = path.poses[k].pose;
    farthest_m =
        std::max(farthest_m, (pose.position - poses[k].T.translation()).lpNorm<Eigen::Infinity>());
    most_turned = std::max(
        most_turned,
        (pose.orientation.toRotationMatrix() - poses[k].T.linear()).lpNorm<Eigen::Infinity>());
  }
  CHECK(farthest_m < kDigits);
  CHECK(most_turned < 10 * kDigits);  // of a quaternion's four
}

// What readers of npm say of a file, or nothing where they cannot be had.
std::optional<Json> told_by_others(const fs::path& file, const TemporaryFolder& folder) {
  const fs::path work = folder.path() / "npm";
  fs::create_directories(work);
  for (const char* source : {"package.json", "read_record.mjs"})
    fs::copy_file(fs::path("test/system/record") / source, work / source,
                  fs::copy_options::overwrite_existing);
  const std::string in_work = "cd " + work.string() + " && ";
  if (run_command(in_work + "npm install --silent --no-audit --no-fund --prefer-offline")
          .exit_code != 0)
    return std::nullopt;
  const CommandResult result =
      run_command(in_work + "node read_record.mjs " + file.string() + " > told.json");
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  return read_json(work / "told.json");
}

}  // namespace

TEST_CASE("A robot's record has the poses of its results", "[system]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const CommandResult run = run_command(
      robot_command(*dataset, folder.path(), "--record-images --set mapping.mode=metric"));
  CAPTURE(run.output);
  REQUIRE(run.exit_code == 0);
  Record record(folder.path() / "record.mcap");
  CHECK(to_string(record.reader.report()) == "");
  const std::size_t rows = line_count(folder.path() / "odometry.tum");
  REQUIRE(rows > 200);
  CHECK(record.counts["/alice/odometry"] == rows);
  CHECK(record.counts["/alice/pose"] == rows);
  CHECK(record.counts["/tf"] >= rows);
  CHECK(record.counts["/alice/left/image_raw/compressed"] > 0);
  CHECK(record.counts["/rosout"] > 0);
  CHECK(record.counts["/diagnostics"] > 0);
  check_equal(record.last<RosPath>("/alice/path"),
              read_trajectory(folder.path() / "optimized.tum"));
  const auto faces = record.last<RosMarker>("/alice/mesh_faces");
  CHECK(faces.header.frame == "alice/map");
  CHECK(faces.points.size() > 1000);
  CHECK(record.last<RosMarkers>("/alice/closures").markers.size() == 4);
}

TEST_CASE("The record of a robot that is killed opens as far as it goes", "[system]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const auto seconds_in = [&](const fs::path& file) {
    const Record record(file);
    return 1e-9 *
           static_cast<double>(record.messages.back().log_time - record.messages.front().log_time);
  };
  // Ends itself after some seconds; the last one or so is not in the record.
  const std::string in_time = "timeout -s KILL 8 ";
  const std::string real_time = robot_command(*dataset, folder.path(), "--serve-limit 0 --rate 1");
  CHECK(run_command(in_time + real_time).exit_code != 0);
  const fs::path file = folder.path() / "record.mcap";
  CHECK(seconds_in(file) > 2.0);
  CHECK(Record(file).reader.report().count(BagFault::kTruncated) == 1);
}

TEST_CASE("Readers that are not ours read a record, whole and cut", "[system]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const CommandResult run = run_command(
      robot_command(*dataset, folder.path(), "--record-images --set mapping.mode=metric"));
  CAPTURE(run.output);
  REQUIRE(run.exit_code == 0);
  const fs::path file = folder.path() / "record.mcap";
  const auto told = told_by_others(file, folder);
  if (!told) {
    WARN("SKIPPED: npm cannot install the readers of test/system/record");
    return;
  }
  const Record record(file);
  CHECK(told->at("whole") == true);
  CHECK(told->at("messages") == record.messages.size());
  for (const auto& [topic, count] : record.counts)
    CHECK(told->at("topics").at(topic).at("count") == count);
  const RosPath path = record.last<RosPath>("/alice/path");
  REQUIRE(told->at("path").size() == path.poses.size());
  for (std::size_t k = 0; k < path.poses.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)  // behind seconds and nanoseconds
      REQUIRE(told->at("path")[k][static_cast<std::size_t>(2 + axis)] ==
              path.poses[k].pose.position[axis]);

  fs::resize_file(file, fs::file_size(file) / 2);
  const auto cut = told_by_others(file, folder);
  REQUIRE(cut);
  CHECK(cut->at("whole") == false);
  CHECK(cut->at("messages") > 0);
  CHECK(cut->at("messages") == Record(file).messages.size());
}

TEST_CASE("A team's records become one", "[system]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const TeamRun run = run_team("config/teams/euroc_two_robots.yaml", *dataset, folder, "--record");
  CAPTURE(run.result.output);
  REQUIRE(run.result.exit_code == 0);
  Record team(folder.path() / "team.mcap");
  CHECK(to_string(team.reader.report()) == "");
  std::size_t messages = 1;  // where `map` is
  for (const char* name : {"a", "b"}) {
    const Record own(folder.path() / name / "record.mcap");
    messages += own.messages.size();
    const std::string prefix = std::string("/") + name;
    CHECK(team.counts[prefix + "/odometry"] == line_count(folder.path() / name / "odometry.tum"));
    check_equal(team.last<RosPath>(prefix + "/path"),
                read_trajectory(folder.path() / name / "optimized.tum"));
  }
  CHECK(team.messages.size() == messages);
  // Of two robots that are joined one's frame hangs in the other's, and that in `map`.
  std::set<std::pair<std::string, std::string>> links;
  for (const ToldMessage& message : team.messages)
    if (message.topic == "/tf" || message.topic == "/tf_static")
      for (const RosTransform& link :
           decode_ros<RosTransforms>("cdr", message.bytes).value->transforms)
        links.emplace(link.header.frame, link.child_frame);
  CHECK(links.contains({"map", "a/map"}));
  CHECK(links.contains({"a/map", "b/map"}));
  CHECK(links.contains({"b/map", "b/odom"}));
  CHECK(links.contains({"b/odom", "b/base_link"}));

  // The evaluation reads the poses from it.
  const std::string evaluate = std::string(KM_BIN_DIR) +
                               "/kimera_multi_evaluate trajectory --truth " +
                               (folder.path() / "a/optimized.tum").string() + " --estimate ";
  const fs::path json = folder.path() / "same.json";
  const CommandResult same = run_command(evaluate + (folder.path() / "team.mcap").string() +
                                         ":/a/path --json " + json.string());
  CAPTURE(same.output);
  REQUIRE(same.exit_code == 0);
  CHECK(read_json(json)["joint"]["position_m"]["max"] < 1e-8);
  const CommandResult both = run_command(evaluate + (folder.path() / "team.mcap").string());
  CAPTURE(both.output);
  CHECK(both.exit_code == 0);
  CHECK(both.output.find("team/a") != std::string::npos);
  CHECK(both.output.find("team/b") != std::string::npos);

  // So are closures: the same as from the folders.
  const auto scores = [&](const std::string& results) {
    return run_command(std::string(KM_BIN_DIR) + "/kimera_multi_evaluate closures --dataset " +
                       dataset->string() + " --truth " +
                       (folder.path() / "a/optimized.tum").string() + " --results" + results);
  };
  const CommandResult by_record = scores(' ' + (folder.path() / "team.mcap").string());
  CAPTURE(by_record.output);
  CHECK(by_record.exit_code == 0);
  CHECK(by_record.output ==
        scores(' ' + (folder.path() / "a").string() + ' ' + (folder.path() / "b").string()).output);
}

}  // namespace km

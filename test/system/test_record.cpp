#include <nlohmann/json.hpp>

#include "apps/lab/pgo/team_graph_file.hpp"
#include "modules/core/io/json.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/modules/recordings/bag_contents.hpp"
#include "test/support/command.hpp"
#include "test/support/eavesdropper.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"
#include "test/system/team_run.hpp"

// Records of robots and teams, read by our reader and by others.

namespace km {
namespace {

// Content of an MCAP file according to readers of npm; nullopt if they are not available.
std::optional<Json> read_by_others(const fs::path& file, const TemporaryFolder& folder) {
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
      run_command(in_work + "node read_record.mjs " + file.string() + " > read.json");
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  return read_json(work / "read.json");
}

std::string record_command(const fs::path& dataset, const std::string& options) {
  return euroc_robot(0, "--name alice --to 12 --serve-limit 100 --record --dataset " +
                            dataset.string() + ' ' + options);
}

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
  CHECK(most_turned < 10 * kDigits);  // error of the four components of quaternions
}

}  // namespace

TEST_CASE("A robot's record has the poses of its results, also for readers that are not ours") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const CommandResult run = succeeded(
      run_command(record_command(*dataset, "--rate max --output " + folder.path().string() +
                                               " --record-images --set mapping.mode=metric")));
  const fs::path file = folder.path() / "record.mcap";
  Record record(file);
  CHECK_THAT(to_string(record.reader->report()), Equals(""));
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
  CHECK(faces.header.frame_id == "alice/map");
  CHECK(faces.points.size() > 1000);
  CHECK(record.last<RosMarkerArray>("/alice/closures").markers.size() == 4);

  const auto read = read_by_others(file, folder);
  if (!read) {
    WARN("npm cannot install the readers of test/system/record");
    return;
  }
  CHECK(read->at("whole") == true);
  CHECK(read->at("messages") == record.messages.size());
  for (const auto& [topic, count] : record.counts)
    CHECK(read->at("topics").at(topic).at("count") == count);
  const RosPath path = record.last<RosPath>("/alice/path");
  REQUIRE(read->at("path").size() == path.poses.size());
  for (std::size_t k = 0; k < path.poses.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)  // behind seconds and nanoseconds
      REQUIRE(read->at("path")[k][static_cast<std::size_t>(2 + axis)] ==
              path.poses[k].pose.position[axis]);
  fs::resize_file(file, fs::file_size(file) / 2);
  const auto cut = read_by_others(file, folder);
  REQUIRE(cut);
  CHECK(cut->at("whole") == false);
  CHECK(cut->at("messages") > 0);
  CHECK(cut->at("messages") == Record(file).messages.size());
}

TEST_CASE(
    "The record of a robot that is killed has all earlier messages, and the resumed run writes "
    "another") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const fs::path first = folder.path() / "record.mcap", second = folder.path() / "record_2.mcap";
  {
    Process robot(
        words_of(record_command(*dataset, "--rate 1 --output " + folder.path().string())));
    const auto has_recorded = [&first](const std::string&) {
      return fs::exists(first) && fs::file_size(first) > 20000;
    };
    REQUIRE(robot.wait_until(has_recorded).has_value());
    robot.kill(SIGKILL);
    CHECK(robot.wait() == -SIGKILL);
  }
  Record killed(first);
  CHECK(killed.counts["/alice/odometry"] > 0);
  CHECK(killed.reader->report().count(BagFault::kTruncated) > 0);
  CHECK(killed.reader->report().entries().size() == 1);

  const auto size = fs::file_size(first);
  Process robot(
      words_of(record_command(*dataset, "--rate max --resume " + folder.path().string())));
  CHECK(robot.wait() == 0);
  CHECK(fs::file_size(first) == size);
  const Record resumed(second);
  CHECK_THAT(to_string(resumed.reader->report()), Equals(""));
  check_equal(resumed.last<RosPath>("/alice/path"),
              read_trajectory(folder.path() / "optimized.tum"));
}

TEST_CASE(
    "Two robots on the halves of a recording localise together, and their records become one") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const TeamRun run = run_team("config/teams/euroc_two_robots.yaml", *dataset, folder, "--record");
  CAPTURE(run.result.output);
  REQUIRE(run.result.exit_code == 0);
  // Bounds of the recording's requirements; the actual errors are two to three times smaller.
  const double max_odometry_ate_m = 0.010;
  const double max_team_ate_m = 0.015;
  const int min_inter_robot_inliers = 10;
  int inliers = 0;
  for (const auto& robot : run.json["robots"]) {
    CHECK(robot["odometry"]["completeness"] > 0.999);
    CHECK(robot["odometry"]["position_m"]["rmse"] < max_odometry_ate_m);
    CHECK(robot["pgo"]["members"].size() == 2);
    inliers += robot["closures"]["inliers"].get<int>();
  }
  CHECK(inliers >= min_inter_robot_inliers);
  CHECK(run.json["optimized"]["joint"]["position_m"]["rmse"] < max_team_ate_m);
  CHECK(run.json["live"]["joint"]["position_m"]["rmse"] < max_team_ate_m);
  for (const char* file :
       {"odometry.tum", "live.tum", "optimized.tum", "pose_graph.g2o", "loop_closures.csv",
        "traffic.csv", "timing.csv", "config.yaml", "summary.json"})
    CHECK(fs::file_size(folder.path() / "a" / file) > 0);

  // The same graph solved once more: a keyframe without a path to the others could not be located.
  Eavesdropper ear = listen_to(read_team_folder(folder.path()), 100);
  CHECK(ear.messages() > 0);
  CHECK(ear.private_poses() > 0);
  CHECK(ear.misfits() == 0);
  CHECK(ear.derivable().empty());

  Record team(folder.path() / "team.mcap");
  CHECK_THAT(to_string(team.reader->report()), Equals(""));
  std::size_t messages = 1;  // begins with the message that places `map`
  for (const char* name : {"a", "b"}) {
    const Record own(folder.path() / name / "record.mcap");
    messages += own.messages.size();
    const std::string prefix = std::string("/") + name;
    CHECK(team.counts[prefix + "/odometry"] == line_count(folder.path() / name / "odometry.tum"));
    check_equal(team.last<RosPath>(prefix + "/path"),
                read_trajectory(folder.path() / name / "optimized.tum"));
  }
  CHECK(team.messages.size() == messages);
  // For two joined robots, the frame of one is a child of the other's, which is a child of `map`.
  const auto links = team.links();
  CHECK(links.contains({"map", "a/map"}));
  CHECK(links.contains({"a/map", "b/map"}));
  CHECK(links.contains({"b/map", "b/odom"}));
  CHECK(links.contains({"b/odom", "b/base_link"}));

  // The evaluation reads the poses from it.
  const auto evaluate = [](const fs::path& truth, const std::string& estimate) {
    return run_command(std::string(KM_BIN_DIR) + "/kimera_multi_evaluate trajectory --truth " +
                       truth.string() + " --estimate " + estimate);
  };
  const fs::path json = folder.path() / "same.json";
  const std::string record = (folder.path() / "team.mcap").string();
  const CommandResult same = succeeded(
      evaluate(folder.path() / "a/optimized.tum", record + ":/a/path --json " + json.string()));
  CHECK(read_json(json)["joint"]["position_m"]["max"] < 1e-8);
  const CommandResult both =
      succeeded(evaluate(*dataset / "mav0/state_groundtruth_estimate0", record));
  CHECK(both.output.find("team/a") != std::string::npos);
  CHECK(both.output.find("team/b") != std::string::npos);

  // So are the closures.
  const auto attached = read_mcap_attachments(record);
  for (const char* file : {"a/keyframes.csv", "a/loop_closures.csv", "b/loop_closures.csv"})
    CHECK(attached.at(file) == folder.read(file));
}

}  // namespace km

#include <catch2/catch.hpp>

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "apps/viewer/view_recorder.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"
#include "test/modules/recordings/bag_contents.hpp"
#include "test/support/patience.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/system/record/other_readers.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr Stamp kSecond = 1'000'000'000;
constexpr Stamp kRecordBegin = 100 * kSecond;

SE3 at(double x, double y) {
  SE3 T = SE3::Identity();
  T.translation() = Eigen::Vector3d(x, y, 0.0);
  return T;
}

const ClosureId kClosure = closure_id({0, 1}, {1, 2});

LabelPalette palette() {
  return LabelPalette({{.id = 5, .name = "wall", .color = {255, 0, 51}}});
}

// Messages of two robots: `alice` moves along x, `bob` 2 m beside her, and both are in her frame.
std::vector<ViewUpdate> team() {
  std::vector<ViewUpdate> all;
  for (const RobotId robot : {RobotId{0}, RobotId{1}}) {
    const auto add = [&](ViewContent content) { all.push_back({robot, 9, 0, std::move(content)}); };
    const Stamp begin = kRecordBegin + robot * 10 * kSecond;
    add(RobotSample{.name = robot == 0 ? "alice" : "bob", .phase = "running"});
    add(ViewKeyframes{false,
                      robot,
                      0,
                      {at(0, 0), at(1, 0), at(2, 0)},
                      {begin, begin + kSecond, begin + 2 * kSecond}});
    const double y = 2.0 * robot;
    add(ViewKeyframes{true, 0, 0, {at(0, y), at(1, y), at(2, y)}});
    add(ViewPose{begin + 5 * kSecond / 2, at(2.5, 0)});
    add(ViewClosures{{{kClosure, ClosureStatus::kKept, 80, 60, ""}}});
    add(ViewImage{.stamp = begin, .jpeg = {0xFF, 0xD8}, .features = {}});
    add(ViewObjects{.anchor = 0,
                    .objects = {{5, {1, 0.5F, 0.25F}, 0.0F, {2, 1, 0.5F}, {0, 1}}},
                    .left_out = 0});
    add(ViewRaster{.anchor = 0,
                   .resolution_m = 0.5F,
                   .origin = {-1, 2, 0},
                   .width = 2,
                   .height = 1,
                   .runs = {1, ViewRaster::kFree, 1, ViewRaster::kOccupied}});
    add(ViewRaster{.kind = RasterKind::kDistances,
                   .anchor = robot,
                   .resolution_m = 0.5F,
                   .origin = {3, 4, 1},
                   .width = 1,
                   .height = 1,
                   .runs = {1, ViewRaster::kFarthest}});
    LabelledMesh sheet = wavy_sheet(4, 0.1);
    sheet.labels.assign(sheet.vertices.size(), 5);
    for (MeshChunk& chunk : split_mesh(sheet, robot, 0, {}).chunks) add(std::move(chunk));
  }
  return all;
}

}  // namespace

TEST_CASE("A viewer's record has the messages of each robot as the robot's own record has them",
          "[viewer]") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "team.mcap";
  ViewRecorder recorder(file, palette());
  for (const ViewUpdate& update : team()) recorder.add(update);
  recorder.finish();
  const Record record(file);
  CHECK(to_string(record.reader->report()) == "");

  const auto path = record.last<RosPath>("/bob/path");
  CHECK(path.header.frame_id == "bob/map");
  REQUIRE(path.poses.size() == 3);
  CHECK(path.poses[1].header.stamp == kRecordBegin + 11 * kSecond);
  CHECK(path.poses[1].pose.position == Eigen::Vector3d(1, 2, 0));
  const auto pose = record.last<RosPoseWithCovarianceStamped>("/bob/pose");  // corrected
  CHECK(pose.header.stamp == kRecordBegin + 25 * kSecond / 2);
  CHECK(pose.pose.pose.position == Eigen::Vector3d(2.5, 2, 0));
  CHECK(record.counts.at("/bob/odometry") == 4);  // three keyframes, one pose
  CHECK(record.last<RosOdometry>("/bob/odometry").twist.twist.linear == Eigen::Vector3d(1, 0, 0));

  const auto faces = record.last<RosMarker>("/alice/mesh_faces");
  CHECK(faces.points.size() == 3 * wavy_sheet(4, 0.1).faces.size());
  REQUIRE_FALSE(faces.colors.empty());
  CHECK(faces.colors[0] == Eigen::Vector4f(1, 0, 0.2F, 1));
  const auto lines = record.last<RosMarkerArray>("/bob/closures").markers.at(3);
  CHECK(lines.ns == "kept");
  CHECK(lines.points == std::vector<Eigen::Vector3d>{{1, 0, 0}, {2, 2, 0}});
  CHECK(record.last<RosCompressedImage>("/bob/left/image_raw/compressed").data ==
        std::vector<std::uint8_t>{0xFF, 0xD8});

  const auto objects = record.last<RosMarkerArray>("/bob/objects").markers;
  REQUIRE(objects.size() == 3);  // the first deletes those before
  CHECK(objects[1].header.frame_id == "bob/map");
  CHECK(objects[1].pose.position == Eigen::Vector3d(1, 0.5, 0.25));
  CHECK(objects[2].text == "wall");
  const auto map = record.last<RosOccupancyGrid>("/bob/map_2d");
  CHECK(map.header.frame_id == "bob/map");
  CHECK(map.info.origin.position == Eigen::Vector3d(-1, 2, 0));
  CHECK(map.data == std::vector<std::uint8_t>{OccupancyGrid::kFree, OccupancyGrid::kOccupied});
  const auto slice = record.last<RosPointCloud2>("/bob/distance_slice");
  CHECK(slice.header.frame_id == "bob/odom");
  CHECK(slice.width == 1);

  std::set<std::pair<std::string, std::string>> links;
  for (const TopicMessage& message : record.messages)
    if (message.topic == "/tf") {
      const auto transforms = decode_ros<RosTFMessage>("cdr", message.bytes);
      REQUIRE(transforms.value);
      for (const RosTransformStamped& link : transforms.value->transforms)
        links.emplace(link.header.frame_id, link.child_frame_id);
    }
  CHECK(links == std::set<std::pair<std::string, std::string>>{{"alice/map", "alice/odom"},
                                                               {"alice/odom", "alice/base_link"},
                                                               {"alice/map", "bob/map"},
                                                               {"bob/map", "bob/odom"},
                                                               {"bob/odom", "bob/base_link"}});

  const auto read = read_by_others(file, folder);
  if (!read) {
    WARN("npm cannot install the readers of test/system/record");
    return;
  }
  CHECK(read->at("whole") == true);
  CHECK(read->at("messages") == record.messages.size());
}

TEST_CASE("A viewer's record is readable while it is written", "[viewer]") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "team.mcap", copy = folder.path() / "copy.mcap";
  ViewRecorder recorder(file, {});
  for (const ViewUpdate& update : team()) recorder.add(update);
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  std::size_t poses = 0;
  while (poses < 4 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (!fs::exists(file)) continue;
    fs::copy_file(file, copy, fs::copy_options::overwrite_existing);
    poses = Record(copy).counts["/bob/pose"];
  }
  CHECK(poses == 4);
}

TEST_CASE("A robot that was started again begins its path from scratch", "[viewer]") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "team.mcap";
  ViewRecorder recorder(file, {});
  for (const ViewUpdate& update : team()) recorder.add(update);
  recorder.add({1, 10, 0, RobotSample{.name = "bob", .phase = "running"}});
  recorder.add({1, 10, 0, ViewKeyframes{false, 1, 0, {at(0, 0)}, {kRecordBegin + 60 * kSecond}}});
  recorder.add({1, 10, 0, ViewKeyframes{true, 1, 0, {at(7, 0)}}});
  recorder.finish();
  const auto path = Record(file).last<RosPath>("/bob/path");
  REQUIRE(path.poses.size() == 1);
  CHECK(path.poses[0].pose.position.x() == 7.0);
}

// Robots that the file has diagnostics of, which are written once a second.
std::set<std::string> diagnosed(const fs::path& file) {
  std::set<std::string> names;
  const Record record(file);
  for (const TopicMessage& message : record.messages)
    if (message.topic == "/diagnostics")
      names.insert(
          decode_ros<RosDiagnosticArray>("cdr", message.bytes).value.value().status[0].hardware_id);
  return names;
}

TEST_CASE("After a robot has left or is silent, a record has no more of its messages", "[viewer]") {
  const bool is_silent = GENERATE(false, true);
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "team.mcap";
  ViewRecorder recorder(file, {}, is_silent ? 0.0 : 1e6);
  for (const ViewUpdate& update : team()) recorder.add(update);
  recorder.add({2, 9, 0, RobotSample{.name = "carol", .phase = "leaving"}});
  std::this_thread::sleep_for(std::chrono::seconds(3));
  recorder.finish();
  CHECK(diagnosed(file) ==
        (is_silent ? std::set<std::string>() : std::set<std::string>{"alice", "bob"}));
}

TEST_CASE("A record that cannot be written throws an error", "[viewer]") {
  ViewRecorder recorder("/dev/full", {});
  for (const ViewUpdate& update : team()) recorder.add(update);
  CHECK_THROWS_WITH(recorder.finish(), Catch::Contains("/dev/full"));
}

}  // namespace km

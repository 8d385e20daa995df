#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/drawings.hpp"
#include "modules/ros_dds/node/ros_output_node.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "runtime/log.hpp"
#include "test/modules/recordings/bag_contents.hpp"
#include "test/support/grid_mesh.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

SE3 at(double x) {
  SE3 T = SE3::Identity();
  T.translation().x() = x;
  return T;
}

Trajectory straight(RobotId anchor) {
  return {.robot = 3, .anchor = anchor, .T_world_kf = {at(0), at(1), at(2)}};
}

const KeyframeId kOwn0{3, 0}, kOwn2{3, 2}, kOther{7, 5};

std::vector<PublishedClosure> closures() {
  return {{closure_id(kOwn0, kOwn2), ClosureStatus::kKept, at(2.5)},
          {closure_id(kOwn0, kOther), ClosureStatus::kRejected, at(10)},
          {closure_id(kOwn2, kOther), ClosureStatus::kCandidate, std::nullopt},
          {closure_id(kOwn0, {3, 9}), ClosureStatus::kCandidate, std::nullopt}};
}

}  // namespace

TEST_CASE("Closures are drawn as lines by their stage") {
  const RosMarkerArray message = closure_lines(closures(), straight(3), {5, "map"});
  REQUIRE(message.markers.size() == 4);
  const auto points = [&](std::size_t kind) { return message.markers[kind].points; };
  using Points = std::vector<Eigen::Vector3d>;
  CHECK(message.markers[0].ns == "candidates");
  CHECK(points(0).empty());  // the other ends are unknown
  CHECK(points(1).empty());
  CHECK(message.markers[2].ns == "rejected");
  CHECK(points(2) == Points{{0, 0, 0}, {10, 0, 0}});
  CHECK(message.markers[3].ns == "kept");
  CHECK(points(3) == Points{{0, 0, 0}, {2, 0, 0}});  // as optimised, not as measured
  for (const RosMarker& marker : message.markers) {
    CHECK(marker.type == RosMarkerType::kLineList);
    CHECK(marker.header.frame_id == "map");
  }
}

TEST_CASE("The faces of a mesh have the colours of their vertices") {
  LabelledMesh mesh;
  mesh.vertices = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  mesh.colors = {{255, 0, 0}, {0, 255, 0}, {0, 0, 51}};
  mesh.faces = {{2, 0, 1}};
  const RosMarker marker = surface_of(mesh, mesh.faces, {5, "map"});
  CHECK(marker.type == RosMarkerType::kTriangleList);
  REQUIRE(marker.points.size() == 3);
  REQUIRE(marker.colors.size() == 3);
  CHECK(marker.points[0] == Eigen::Vector3d(7, 8, 9));
  CHECK(marker.colors[0] == Eigen::Vector4f(0, 0, 0.2F, 1));
  CHECK(marker.colors[1] == Eigen::Vector4f(1, 0, 0, 1));
  mesh.colors.clear();
  CHECK(surface_of(mesh, mesh.faces, {}).colors.empty());
}

TEST_CASE("A type definition contains each of its nested types once") {
  const std::string path = ros_definition(RosPath::kType);
  CHECK(path.starts_with("std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n====="));
  std::size_t parts = 0;
  for (std::size_t at = path.find("MSG: "); at != path.npos; at = path.find("MSG: ", at + 1))
    ++parts;
  CHECK(parts == 6);  // Header, PoseStamped, Time, Pose, Point, Quaternion
  CHECK(ros2_name(RosPath::kType) == "nav_msgs/msg/Path");
  CHECK_THROWS_AS(ros_definition("a/B"), std::invalid_argument);
}

TEST_CASE("A robot's record holds the published messages and the final states") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.mcap";
  Topic<OdometryState> odometry;
  Topic<KeyframeOdometry> keyframes;
  Topic<Trajectory> trajectories;
  Topic<SensorPacket> packets;
  std::string lost;
  RosOutputNode node(
      "record", std::make_unique<McapSink>(file, [&lost](const auto& why) { lost = why; }),
      {.robot = "bob 3",
       .id = 3,
       .name_of = [](RobotId robot) { return robot == 3 ? "bob 3" : "alice"; },
       .mesh_points = 100,
       .objects = LabelPalette({{7, "chair", {255, 0, 0}}}),
       .draws = true,
       .logs = true,
       .state_bytes_per_s = 1e-3},
      [] {
        return std::vector<RosDiagnosticStatus>{{1, "sensors", "faulty", "", {{"gaps", "3"}}}};
      },
      [] { return closures(); }, {odometry, keyframes, trajectories, In<SensorPacket>(packets)});
  node.start();
  for (Stamp k = 0; k < 30; ++k) {
    odometry.publish(OdometryState{
        .stamp = 1000 + k, .T_odom_body = at(0.1 * double(k)), .v_odom = {0.5, 0, 0}});
    if (k % 10 == 0)
      keyframes.publish(
          KeyframeOdometry{.id = {3, static_cast<std::uint32_t>(k / 10)}, .stamp = 1000 + k});
  }
  trajectories.publish(straight(3));
  trajectories.publish(straight(7));  // too soon after the one before to be published
  LabelledMesh mesh;
  mesh.vertices = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  mesh.faces = {{0, 1, 2}};
  node.offer(std::make_shared<const LabelledMesh>(mesh));
  node.offer(
      std::make_shared<const OccupancyGrid>(OccupancyGrid{0.5, {-1, 2}, 2, 1, {100, -1}, 3}));
  const MapObject chair{.label = 7, .box = {{1, 2, 3}, 0.5, {2, 1, 4}}};
  node.offer(std::make_shared<const ObjectList>(ObjectList{0, {chair}}));
  log::info("vio") << "begins";
  StereoFrame frame{.stamp = 1007, .left = {8, 8, std::vector<std::uint8_t>(64, 9)}, .right = {}};
  packets.publish(SensorPacket{std::make_shared<const StereoFrame>(frame), {}});
  node.stop();
  node.finish(std::vector<StampedPose>{{1000, at(5)}, {1001, at(6)}}, closures(),
              {{"a.csv", "1,2"}});
  CHECK(read_mcap_attachments(file) == std::map<std::string, std::string>{{"a.csv", "1,2"}});
  CHECK(lost.empty());
  CHECK(node.dropped() == 0);

  Record record(file);
  CHECK(to_string(record.reader->report()) == "");
  CHECK(record.counts["/bob_3/odometry"] == 30);
  CHECK(record.counts["/bob_3/pose"] == 30);
  CHECK(record.counts["/bob_3/path"] == 2);
  CHECK(record.counts["/bob_3/mesh"] == 1);
  const auto map = record.last<RosOccupancyGrid>("/bob_3/map_2d");
  CHECK(map.header.frame_id == "bob_3/map");
  CHECK(map.info.width == 2);
  CHECK(map.info.height == 1);
  CHECK(map.info.resolution == 0.5F);
  CHECK(map.info.origin.position == Eigen::Vector3d(-1, 2, 3));
  CHECK(map.data == std::vector<std::uint8_t>{100, 255});
  const auto received = record.last<RosOdometry>("/bob_3/odometry");
  CHECK(received.header.frame_id == "bob_3/odom");
  CHECK(received.child_frame_id == "bob_3/base_link");
  CHECK(received.pose.pose.position.x() == Approx(2.9));
  CHECK(received.twist.twist.linear.x() == 0.5);
  const auto objects = record.last<RosMarkerArray>("/bob_3/objects");
  REQUIRE(objects.markers.size() == 3);
  CHECK(objects.markers[0].action == RosMarkerAction::kDeleteAll);
  const RosMarker &box = objects.markers[1], &name = objects.markers[2];
  CHECK(box.type == RosMarkerType::kCube);
  CHECK(box.pose.position == chair.box.center);
  CHECK(box.pose.orientation.angularDistance(Eigen::Quaterniond(chair.box.pose().linear())) < 1e-9);
  CHECK(box.scale == chair.box.size_m);
  CHECK(box.color.head<3>() == Eigen::Vector3f(1, 0, 0));
  CHECK(name.type == RosMarkerType::kText);
  CHECK(name.text == "chair");
  CHECK(name.pose.position.z() > 3.0 + 0.5 * 4.0);
  const auto path = record.last<RosPath>("/bob_3/path");
  REQUIRE(path.poses.size() == 2);
  CHECK(path.poses[1].header.stamp == 1001);
  CHECK(path.poses[1].pose.position.x() == 6.0);
  CHECK(path.header.frame_id == "bob_3/map");
  // The robot has joined alice, so /tf contains its own frame in the frame of the team.
  const auto transforms = record.last<RosTFMessage>("/tf");
  CHECK(transforms.transforms[0].header.frame_id == "alice/map");
  CHECK(transforms.transforms[0].child_frame_id == "bob_3/map");
  const auto lines = record.last<RosMarkerArray>("/bob_3/closures");
  CHECK(lines.markers[3].points.size() == 2);
  const auto faces = record.last<RosMarker>("/bob_3/mesh_faces");
  CHECK(faces.points.size() == 3);
  const auto line = record.last<RosLog>("/rosout");
  CHECK(line.msg == "begins");
  CHECK(line.name == "bob_3.vio");
  const auto image = record.last<RosCompressedImage>("/bob_3/left/image_raw/compressed");
  CHECK(image.format == "jpeg");
  CHECK(image.header.stamp == 1007);
  CHECK(image.data.size() > 100);
  for (const TopicMessage& message : record.messages) CHECK(message.log_time >= 1000);
}

TEST_CASE("The map frame of a robot that has not joined has no parent frame") {
  const RobotId anchor = GENERATE(as<RobotId>(), 3, 7);
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.mcap";
  Topic<OdometryState> odometry;
  Topic<KeyframeOdometry> keyframes;
  Topic<Trajectory> trajectories;
  RosOutputNode node(
      "record", std::make_unique<McapSink>(file, [](const auto&) {}),
      {.robot = "bob", .id = 3, .name_of = [](RobotId robot) { return robot == 3 ? "bob" : "al"; }},
      [] { return std::vector<RosDiagnosticStatus>(); }, {},
      {odometry, keyframes, trajectories, {}});
  node.start();
  odometry.publish(OdometryState{.stamp = 1000});
  trajectories.publish(straight(anchor));
  node.stop();
  node.finish({}, {}, {});
  const auto links = Record(file).links();
  CHECK(links.contains({"bob/map", "bob/odom"}));
  CHECK(links.contains({"bob/odom", "bob/base_link"}));
  CHECK(links.contains({"al/map", "bob/map"}) == (anchor == 7));
  CHECK(links.size() == (anchor == 7 ? 3 : 2));
}

TEST_CASE("A record ends when the disk is full and reports it once") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.mcap";
  fs::create_symlink("/dev/full", file);
  std::vector<std::string> lost;
  McapSink sink(file, [&lost](const auto& why) { lost.push_back(why); });
  const auto topic = sink.open({"/a/pose", RosPoseStamped::kType});
  for (Stamp k = 1; k < 5; ++k) {
    sink.put(topic, k, encode_ros(RosPoseStamped{}));
    sink.flush();
  }
  sink.finish();
  CHECK(lost == std::vector{file.string() + ": cannot be written: No space left on device"});
  CHECK(fs::is_symlink(file));
}

TEST_CASE("The record of a killed process is complete up to the last flush") {
  const TemporaryFolder folder;
  const fs::path file = folder.write("a.mcap", "of an earlier run");
  McapSink sink(file, [](const auto&) {});
  const auto topic = sink.open({"/a/pose", RosPoseStamped::kType});
  sink.put(topic, std::nullopt, encode_ros(RosPoseStamped{}));  // before there is a time
  for (Stamp k = 1; k < 5; ++k) sink.put(topic, k, encode_ros(RosPoseStamped{{k, "map"}, {}}));
  sink.flush();
  sink.put(topic, 5, encode_ros(RosPoseStamped{}));
  const auto reader = open_mcap(file);
  const auto messages = topic_messages_of(*reader);
  REQUIRE(messages.size() == 4);
  CHECK(messages[0].log_time == 1);
  CHECK(messages[0].type == "geometry_msgs/msg/PoseStamped");
  CHECK(messages[0].encoding == "cdr");
  CHECK(reader->report().count(BagFault::kTruncated) == 1);
}

namespace {

template <typename T>
T value_at(const RosPointCloud2& cloud, std::size_t point, std::size_t field) {
  T value{};
  std::memcpy(&value, &cloud.data[point * cloud.point_step + cloud.fields[field].offset],
              sizeof(value));
  return value;
}

TEST_CASE("A mesh is published as its vertices with their colours") {
  LabelledMesh mesh;
  mesh.vertices = {{1, 2, 3}, {4, 5, 6.5F}};
  mesh.colors = {{0x12, 0x34, 0x56}, {1, 2, 3}};
  const RosPointCloud2 cloud = cloud_of(mesh, 10, {5, "map"});
  CHECK(cloud.header.frame_id == "map");
  CHECK(cloud.height == 1);
  CHECK(cloud.width == 2);
  CHECK(cloud.point_step == 16);
  CHECK(cloud.row_step == 32);
  REQUIRE(cloud.data.size() == 32);
  CHECK(cloud.fields[3].name == "rgb");
  CHECK(value_at<float>(cloud, 1, 2) == 6.5F);
  CHECK(value_at<std::uint32_t>(cloud, 0, 3) == 0x123456);
  mesh.colors.clear();
  CHECK(cloud_of(mesh, 10, {}).point_step == 12);
  CHECK(cloud_of(mesh, 10, {}).fields.size() == 3);
}

TEST_CASE("A large mesh is published as a bounded number of vertices from all its parts") {
  LabelledMesh mesh;
  for (int k = 0; k < 1000; ++k) mesh.vertices.emplace_back(static_cast<float>(k), 0.0F, 0.0F);
  for (const std::size_t most : {1U, 7U, 300U, 999U, 1000U, 2000U}) {
    CAPTURE(most);
    const RosPointCloud2 cloud = cloud_of(mesh, most, {});
    CHECK(cloud.width <= most);
    CHECK(2 * cloud.width > std::min<std::size_t>(most, 1000));
    CHECK(value_at<float>(cloud, cloud.width - 1, 0) >=
          999.0F - 1000.0F / static_cast<float>(cloud.width));
  }
}

// A square of `n` by `n` cells of 5 cm.
LabelledMesh square(std::size_t n) {
  LabelledMesh mesh = grid_mesh(n, n, [](std::size_t x, std::size_t y) {
    return Eigen::Vector3f(0.05F * static_cast<float>(x), 0.05F * static_cast<float>(y), 1.0F);
  });
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.colors.push_back(
        {static_cast<std::uint8_t>(v / (n + 1)), static_cast<std::uint8_t>(v % (n + 1)), 0});
  return mesh;
}

double area_m2(const LabelledMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.faces)
    area += 0.5 * static_cast<double>((mesh.vertices[b] - mesh.vertices[a])
                                          .cross(mesh.vertices[c] - mesh.vertices[a])
                                          .norm());
  return area;
}

// Points of each piece, as a viewer shows them that has received all markers.
void show(SurfacePieces& pieces, std::map<std::int32_t, std::size_t>& shown) {
  while (const auto marker = pieces.next({7, "map"})) {
    CHECK(marker->header.frame_id == "map");
    CHECK(encode_ros(*marker).size() < 65536);
    CHECK(marker->colors.size() == marker->points.size());
    if (marker->action == RosMarkerAction::kDelete)
      CHECK(shown.erase(marker->id) == 1);
    else
      shown[marker->id] = marker->points.size();
  }
}

std::size_t faces_of(const std::map<std::int32_t, std::size_t>& shown) {
  std::size_t points = 0;
  for (const auto& [id, count] : shown) points += count;
  return points / 3;
}

TEST_CASE(
    "All faces of a mesh are published in small pieces and pieces of the former mesh are deleted") {
  SurfacePieces pieces;
  CHECK_FALSE(pieces.next({}));
  std::map<std::int32_t, std::size_t> shown;
  for (const std::uint32_t n : {40U, 70U, 10U, 0U, 20U}) {
    CAPTURE(n);
    pieces.offer(std::make_shared<const LabelledMesh>(square(n)));
    show(pieces, shown);
    CHECK(faces_of(shown) == 2 * n * n);
    CHECK(shown.size() == SurfacePieces::count(2 * n * n));
  }
}

TEST_CASE("A new mesh waits until the present one is published") {
  SurfacePieces pieces;
  pieces.offer(std::make_shared<const LabelledMesh>(square(40)));  // 7 pieces
  REQUIRE(pieces.next({}));
  pieces.offer(std::make_shared<const LabelledMesh>(square(10)));
  pieces.offer(std::make_shared<const LabelledMesh>(square(20)));
  for (int k = 1; k < 7; ++k) CHECK(pieces.next({})->id == k);
  CHECK(pieces.next({})->points.size() == 3 * 500);  // pieces of the newest mesh
  CHECK(pieces.next({})->points.size() == 3 * 300);
}

TEST_CASE("A mesh with too many faces is coarsened and covers the same area") {
  const LabelledMesh mesh = square(100);
  CHECK(coarsened(mesh, 20000).faces == mesh.faces);
  for (const std::size_t most : {10000U, 1000U, 100U}) {
    const LabelledMesh coarse = coarsened(mesh, most);
    CAPTURE(most, coarse.faces.size());
    CHECK(coarse.faces.size() <= most);
    CHECK(coarse.faces.size() > most / 5);
    CHECK(area_m2(coarse) == Approx(area_m2(mesh)).epsilon(0.3));
    CHECK(coarse.colors.size() == coarse.vertices.size());
  }
}

}  // namespace
}  // namespace km

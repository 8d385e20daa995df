#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/node/live_topics.hpp"
#include "modules/ros_dds/node/ros_output_node.hpp"
#include "runtime/ros/ros_discovery.hpp"
#include "runtime/ros/ros_publisher.hpp"
#include "runtime/ros/ros_subscription.hpp"
#include "test/modules/sensors/listed_bag.hpp"
#include "test/support/patience.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

int random_domain() {
  std::random_device random;
  return static_cast<int>(random() % 100);
}

std::shared_ptr<const RosNetwork> network() {
  static const auto shared =
      std::make_shared<const RosNetwork>(RosConfig{.domain = random_domain(), .interface = "lo"});
  return shared;
}

RosImu imu(Stamp stamp) {
  RosImu message;
  message.header.stamp = stamp;
  message.angular_velocity.x() = 0.25;
  return message;
}

void wait_for_reader(const RosPublisher& publisher) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (publisher.reader_count() == 0 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  REQUIRE(publisher.reader_count() > 0);
}

TEST_CASE("A message published on a ROS topic is received unchanged") {
  LiveBag subscription(network(), {{"/a/imu", "sensor_msgs/msg/Imu", RosQos::kSensorData, 100},
                                   {"a/image", "sensor_msgs/Image", RosQos::kSensorData, 10}});
  const RosPublisher images(network(), "/a/image", "sensor_msgs/msg/Image", RosQos::kSensorData,
                            10);
  const RosPublisher imus(network(), "/a/imu", "sensor_msgs/Imu", RosQos::kReliable, 10);
  wait_for_reader(images);
  wait_for_reader(imus);
  const auto sent_imu = encode_ros(imu(17)),
             sent_image = encode_ros(mono_image({18, "left"}, 752, 480, 7));
  imus.publish(sent_imu);
  images.publish(sent_image);
  for (int k = 0; k < 2; ++k) {
    const auto received = subscription.next();
    REQUIRE(received);
    const auto& sent = received->channel == 0 ? sent_imu : sent_image;
    REQUIRE(received->bytes.size() == (sent.size() + 3) / 4 * 4);
    CHECK(std::equal(sent.begin() + 4, sent.end(), received->bytes.begin() + 4));
    CHECK(received->bytes[1] == 1);
    CHECK(received->log_time > 0);
  }
  CHECK(subscription.report().empty());
}

TEST_CASE("Every known type can be published, and nested messages cross") {
  for (const std::string& type : known_ros_types()) {
    CAPTURE(type);
    CHECK_NOTHROW(RosPublisher(network(), "/" + type, type, RosQos::kReliable, 10));
  }
  const auto crosses = []<typename Message>(const Message& message) {
    CAPTURE(Message::kType);
    const std::string type(Message::kType), topic = "/crosses/" + type;
    RosSubscription subscription(network(), {{topic, type, RosQos::kReliable, 10}});
    const RosPublisher publisher(network(), topic, type, RosQos::kReliable, 10);
    wait_for_reader(publisher);
    publisher.publish(encode_ros(message));
    const auto received = subscription.next();
    REQUIRE(received);
    const auto decoded = decode_ros<Message>("cdr", received->bytes);
    CAPTURE(decoded.refusal);
    REQUIRE(decoded.value);
    CHECK(encode_ros(*decoded.value) == encode_ros(message));
  };
  crosses(RosPath{{7, "map"}, {{{8, "map"}, {}}, {{9, "map"}, {}}}});
  crosses(RosDiagnosticArray{{7, ""}, {{1, "a", "b", "c", {{"d", "e"}}}, {}}});
  RosMarker marker;
  marker.ns = "mesh";
  marker.points = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  marker.colors = {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}};
  marker.text = "faces";
  crosses(marker);
}

TEST_CASE("Viewers receive the pose, diagnostics and mesh of the robot") {
  Topic<OdometryState> odometry;
  Topic<KeyframeOdometry> keyframes;
  Topic<Trajectory> trajectories;
  const auto diagnose = [] {
    return std::vector<RosDiagnosticStatus>{{1, "sensors", "faulty", "", {{"gaps", "3"}}}};
  };
  RosOutputNode node("ros_output", std::make_unique<LiveSink>(network()),
                     {.robot = "robot 3", .mesh_points = 2, .mesh_faces = 10}, diagnose, {},
                     {odometry, keyframes, trajectories, {}});
  RosSubscription viewer(network(),
                         {{"/robot_3/pose", "geometry_msgs/PoseWithCovarianceStamped"},
                          {"/tf", "tf2_msgs/TFMessage", RosQos::kReliable},
                          {"/robot_3/mesh", "sensor_msgs/PointCloud2", RosQos::kLatched},
                          {"/diagnostics", "diagnostic_msgs/DiagnosticArray"},
                          {"/robot_3/mesh_faces", "visualization_msgs/Marker", RosQos::kLatched}});
  OdometryState state{.stamp = 5};
  state.T_odom_body.translation() = Eigen::Vector3d(1, 2, 3);
  KeyframeOdometry keyframe{.id = {}, .stamp = 5};
  SE3 T_map_body = SE3::Identity();
  T_map_body.translation() = Eigen::Vector3d(10, 2, 3);
  node.start();
  odometry.publish(state);
  keyframes.publish(keyframe);
  trajectories.publish(Trajectory{0, 0, {T_map_body}});
  LabelledMesh mesh;
  mesh.vertices = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  mesh.faces = {{0, 1, 2}};
  node.offer(std::make_shared<const LabelledMesh>(mesh));
  // Publishes until the viewer has received all messages, because it may have subscribed late, with
  // a time and with the correction.
  std::map<std::size_t, std::vector<std::uint8_t>> newest;  // by topic
  const auto read = [&]<typename Message>(std::size_t topic, const Message&) {
    return decode_ros<Message>("cdr", newest.at(topic)).value.value();
  };
  const auto has_all = [&] {
    return newest.size() == 5 && read(3, RosDiagnosticArray{}).header.stamp > 0 &&
           read(0, RosPoseWithCovarianceStamped{}).pose.pose.position.x() == 10.0 &&
           read(1, RosTFMessage{}).transforms.at(0).transform.translation.x() == 9.0;
  };
  for (int messages = 0; !has_all(); ++messages) {
    REQUIRE(messages < 100'000);  // some seconds
    state.stamp += 10;
    odometry.publish(state);
    auto message = viewer.next();
    REQUIRE(message);
    newest[message->topic] = std::move(message->bytes);
  }
  node.stop();
  CHECK(read(0, RosPoseWithCovarianceStamped{}).header.frame_id == "map");
  const auto transforms = read(1, RosTFMessage{}).transforms;
  CHECK(transforms.at(0).child_frame_id == "robot_3/odom");
  CHECK(transforms.at(1).child_frame_id == "robot_3/base_link");
  CHECK(read(2, RosPointCloud2{}).width == 2);  // at most two of three vertices
  CHECK(read(4, RosMarker{}).points.size() == 3);
  const auto diagnostics = read(3, RosDiagnosticArray{}).status;
  REQUIRE(diagnostics.size() == 2);
  CHECK(diagnostics[0].name == "robot_3: odometry");
  CHECK(diagnostics[0].level == RosLevel::kOk);
  CHECK(diagnostics[1].name == "robot_3: sensors");
  CHECK(diagnostics[1].values[0].value == "3");
}

TEST_CASE("A robot that is not localised publishes no pose in the map") {
  class CountingSink final : public RosSink {
   public:
    explicit CountingSink(std::map<std::string, int>& counts) : counts_(counts) {}
    std::size_t open(const PublishedTopic& topic) override {
      names_.push_back(topic.name);
      return names_.size() - 1;
    }
    void put(std::size_t topic, std::optional<Stamp> /*time*/,
             std::span<const std::uint8_t> /*message*/) override {
      ++counts_[names_[topic]];
    }

   private:
    std::map<std::string, int>& counts_;
    std::vector<std::string> names_;
  };
  Topic<OdometryState> odometry;
  Topic<KeyframeOdometry> keyframes;
  Topic<Trajectory> trajectories;
  const bool is_localised = GENERATE(false, true);
  std::map<std::string, int> counts;
  RosOutputNode node("ros_output", std::make_unique<CountingSink>(counts),
                     {.robot = "a", .awaits_trajectory = true},
                     [] { return std::vector<RosDiagnosticStatus>(); }, {},
                     {odometry, keyframes, trajectories, {}});
  node.start();
  if (is_localised) trajectories.publish(Trajectory{0, 0, {SE3::Identity()}});
  OdometryState state;
  for (state.stamp = 1; state.stamp <= 3; ++state.stamp) odometry.publish(state);
  node.stop();
  CHECK(counts["/a/odometry"] == 3);
  CHECK(counts["/tf"] == 3);
  CHECK(counts["/a/pose"] == (is_localised ? 3 : 0));
}

TEST_CASE("A publisher is discovered as long as it exists") {
  const auto shared = network();
  RosDiscovery discovery(*shared);
  const RosPublisher stays(shared, "/stays", "visualization_msgs/Marker", RosQos::kReliable, 1);
  {
    const RosPublisher ends(shared, "/ends", "visualization_msgs/Marker", RosQos::kReliable, 1);
    CHECK(std::ranges::count(discovery.publishers(), "/ends", &TopicPublisher::topic) == 1);
  }
  CHECK(std::ranges::count(discovery.publishers(), "/ends", &TopicPublisher::topic) == 0);
  CHECK(std::ranges::count(discovery.publishers(), "/stays", &TopicPublisher::topic) == 1);
}

TEST_CASE("A late subscriber receives as many latched messages as the depth") {
  constexpr int kKept = 5;
  const RosPublisher publisher(network(), "/pieces", "visualization_msgs/Marker", RosQos::kLatched,
                               kKept);
  for (int k = 0; k < kKept + 2; ++k) {
    RosMarker piece;
    piece.id = k;
    publisher.publish(encode_ros(piece));
  }
  RosSubscription late(network(), {{"/pieces", "visualization_msgs/Marker", RosQos::kLatched, 10}});
  for (int k = 2; k < kKept + 2; ++k) {
    const auto received = late.next();
    REQUIRE(received);
    CHECK(decode_ros<RosMarker>("cdr", received->bytes).value->id == k);
  }
}

TEST_CASE("Bytes that are no message of the topic are not published") {
  const RosPublisher publisher(network(), "/b/imu", "sensor_msgs/msg/Imu", RosQos::kReliable, 10);
  auto bytes = encode_ros(imu(1));
  bytes.resize(bytes.size() - 100);
  CHECK_THROWS_AS(publisher.publish(bytes), DdsError);
  CHECK_THROWS_AS(
      RosPublisher(network(), "/b/scan", "sensor_msgs/msg/LaserScan", RosQos::kReliable, 10),
      std::invalid_argument);
}

}  // namespace
}  // namespace km

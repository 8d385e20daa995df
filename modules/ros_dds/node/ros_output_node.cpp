#include "modules/ros_dds/node/ros_output_node.hpp"

#include <algorithm>

#include "modules/core/io/text_table.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/images/image_view.hpp"
#include "runtime/clock.hpp"
#include "runtime/thread.hpp"

namespace km {
namespace {

constexpr double kLate_s = 2.0;
// Maximum number of images and meshes, together, that wait for the encoder.
constexpr std::size_t kImages = 8;
constexpr double kPiece_bytes = 65536.0;

RosPose message_of(const SE3& T) {
  return {T.translation(), Eigen::Quaterniond(T.linear())};
}

RosTransform transform_of(const SE3& T) {
  return {T.translation(), Eigen::Quaterniond(T.linear())};
}

RosOccupancyGrid message_of(const OccupancyGrid& grid, const RosHeader& header) {
  RosOccupancyGrid message{.header = header,
                           .info = {.map_load_time = header.stamp,
                                    .resolution = static_cast<float>(grid.resolution_m),
                                    .width = static_cast<std::uint32_t>(grid.width),
                                    .height = static_cast<std::uint32_t>(grid.height),
                                    .origin = {}},
                           .data = {grid.cells.begin(), grid.cells.end()}};
  message.info.origin.position << grid.origin, grid.z_m;
  return message;
}

std::uint8_t level_of(log::Level level) {
  switch (level) {
    case log::Level::kError:
      return RosLogLevel::kError;
    case log::Level::kWarn:
      return RosLogLevel::kWarn;
    case log::Level::kInfo:
      return RosLogLevel::kInfo;
    case log::Level::kDebug:
      break;
  }
  return RosLogLevel::kDebug;
}

}  // namespace

RosOutputNode::RosOutputNode(std::string_view name, std::unique_ptr<RosSink> sink,
                             RosOutputOptions options, Diagnose diagnose, Closures closures,
                             const RosOutputTopics& topics)
    // A disk may block for long, and no other node waits for this one.
    : WorkerNode({.name = std::string(name),
                  .queue = options.queue,
                  .overflow = Overflow::kDropOldest,
                  .tick_s = 1.0,
                  .step_limit_s = 300.0}),
      sink_(std::move(sink)),
      options_(std::move(options)),
      name_(ros_name(options_.robot)),
      odom_(name_ + "/odom"),
      base_link_(name_ + "/base_link"),
      map_(map_of(options_.id)),
      diagnose_(std::move(diagnose)),
      closures_of_(std::move(closures)),
      piece_bytes_(options_.mesh_bytes_per_s, kPiece_bytes, kPiece_bytes),
      encoder_(
          kImages, Overflow::kDropOldest,
          [this](const Encoded& input) {
            work_in_background();
            std::visit([this](const auto& message) { encode(message); }, input);
          },
          std::string(name) + "_enc") {
  open_topics(topics.images.has_value());
  follow(topics.odometry, topics.keyframes, topics.trajectory);
  if (topics.images)
    topics.images->subscribe([this](const auto& packet) { encoder_.post(packet->frame); });
}

void RosOutputNode::open_topics(bool has_images) {
  const std::string prefix = '/' + name_ + '/';
  const auto latest = [&](const char* name, std::string_view type) {
    return LatestTopic{.topic = sink_->open({prefix + name, type, true, 1})};
  };
  constexpr int kManyTransforms = 100;
  odometry_ = sink_->open({prefix + "odometry", RosOdometry::kType});
  pose_ = sink_->open({prefix + "pose", RosPoseWithCovarianceStamped::kType});
  tf_ = sink_->open({"/tf", RosTFMessage::kType, false, kManyTransforms});
  path_ = latest("path", RosPath::kType);
  mesh_ = latest("mesh", RosPointCloud2::kType);
  map_2d_ = latest("map_2d", RosOccupancyGrid::kType);
  diagnostics_ = sink_->open({"/diagnostics", RosDiagnosticArray::kType});
  if (options_.draws || options_.mesh_faces > 0) {
    const std::size_t pieces = SurfacePieces::count(static_cast<std::size_t>(options_.mesh_faces));
    faces_ = sink_->open(
        {prefix + "mesh_faces", RosMarker::kType, true, std::max(static_cast<int>(pieces), 1)});
  }
  if (options_.draws) {
    closures_ = latest("closures", RosMarkerArray::kType);
  }
  if (options_.objects) objects_ = latest("objects", RosMarkerArray::kType);
  if (options_.logs) log_ = sink_->open({"/rosout", RosLog::kType});
  if (has_images)
    image_ = sink_->open({prefix + "left/image_raw/compressed", RosCompressedImage::kType});
}

void RosOutputNode::start_sources() {
  encoder_.start();
  if (options_.logs) log::set_listener([this](const log::Entry& entry) { listen(entry); });
}

void RosOutputNode::stop_sources() noexcept {
  if (options_.logs) log::set_listener({});
  encoder_.stop();
}

std::size_t RosOutputNode::dropped() const {
  return load().dropped + encoder_.load().dropped;
}

void RosOutputNode::listen(const log::Entry& entry) {
  RosLog line;
  line.level = level_of(entry.level);
  line.name = name_ + '.' + entry.tag;
  line.msg = entry.text;
  post(std::make_shared<const RosLog>(std::move(line)));
}

void RosOutputNode::encode(const Image& image) {
  constexpr int kQuality = 80;
  post(std::make_shared<const RosCompressedImage>(RosCompressedImage{
      {image->stamp, name_ + "/left_camera"}, "jpeg", encode_jpeg(view(image->left), kQuality)}));
}

void RosOutputNode::encode(const std::shared_ptr<const LabelledMesh>& mesh) {
  const auto most = static_cast<std::size_t>(options_.mesh_faces);
  post(RosCoarseMesh{mesh->faces.size() <= most
                         ? mesh
                         : std::make_shared<const LabelledMesh>(coarsened(*mesh, most))});
}

std::string RosOutputNode::map_of(RobotId anchor) const {
  return options_.name_of ? ros_name(options_.name_of(anchor)) + "/map" : "map";
}

// Time of the sensors. After the last image it advances with the steady clock.
std::optional<Stamp> RosOutputNode::time() const {
  if (!stamp_) return std::nullopt;
  return *stamp_ + nanoseconds(steady_now_s() - stamp_arrived_s_);
}

// Returns the size of the message [bytes].
template <typename Message>
std::size_t RosOutputNode::publish(std::size_t topic, const Message& message) {
  const auto bytes = encode_ros(message);
  if (const auto now = time()) latest_ = std::max(latest_.value_or(*now), *now);
  sink_->put(topic, latest_, bytes);
  return bytes.size();
}

void RosOutputNode::step(const Topic<OdometryState>::Message& state) {
  frames_.add(*state);
  ++poses_;
  stamp_ = state->stamp;
  speed_mps_ = state->v_odom.norm();
  stamp_arrived_s_ = steady_now_s();
  RosOdometry odometry;
  odometry.header = {state->stamp, odom_};
  odometry.child_frame_id = base_link_;
  odometry.pose.pose = message_of(state->T_odom_body);
  odometry.twist.twist.linear = state->T_odom_body.linear().transpose() * state->v_odom;
  odometry.twist.twist.angular = frames_.angular_rate();
  publish(odometry_, odometry);
  RosTFMessage transforms;
  if (!trajectory_->T_world_kf.empty() || !options_.awaits_trajectory) {
    const UncertainPose T_map_body = frames_.T_map_body(state->T_odom_body);
    RosPoseWithCovarianceStamped pose{{state->stamp, map_}, {message_of(T_map_body.T), {}}};
    Eigen::Map<Matrix6>(pose.pose.covariance.data()) = along_fixed_axes(T_map_body);
    publish(pose_, pose);
    transforms.transforms.push_back(
        {{state->stamp, map_}, odom_, transform_of(frames_.T_map_odom())});
  }
  transforms.transforms.push_back(
      {{state->stamp, odom_}, base_link_, transform_of(state->T_odom_body)});
  publish(tf_, transforms);
  publish_pieces();
}

void RosOutputNode::step(const Topic<KeyframeOdometry>::Message& keyframe) {
  frames_.add(*keyframe);
  if (stamp_ && *stamp_ >= keyframe->stamp) return;
  stamp_ = keyframe->stamp;  // the input is a pose graph without images
  stamp_arrived_s_ = steady_now_s();
}

void RosOutputNode::step(const Topic<Trajectory>::Message& trajectory) {
  frames_.add(*trajectory);
  trajectory_ = trajectory;
  path_.changed = closures_.changed = true;
  publish_latest(false);
}

void RosOutputNode::step(const std::shared_ptr<const LabelledMesh>& mesh) {
  newest_mesh_ = mesh;
  mesh_.changed = options_.mesh_points > 0 && !mesh->empty();
  if (options_.mesh_faces > 0) encoder_.post(mesh);
  publish_latest(false);
}

void RosOutputNode::step(const RosCoarseMesh& coarse) {
  pieces_.offer(coarse.mesh);
  publish_pieces();
}

void RosOutputNode::step(const Topic<ObjectList>::Message& objects) {
  newest_objects_ = objects;
  objects_.changed = options_.objects.has_value();
  publish_latest(false);
}

void RosOutputNode::step(const std::shared_ptr<const OccupancyGrid>& grid) {
  newest_map_2d_ = grid;
  map_2d_.changed = true;
  publish_latest(false);
}

void RosOutputNode::step(const std::shared_ptr<const RosLog>& line) {
  RosLog stamped = *line;
  stamped.stamp = time().value_or(0);
  publish(log_, stamped);
}

void RosOutputNode::step(const std::shared_ptr<const RosCompressedImage>& image) {
  sink_->put(image_, image->header.stamp, encode_ros(*image));
}

void RosOutputNode::publish_latest(bool all) {
  const auto publish_if_due = [&](LatestTopic& topic, const auto& publish_it) {
    const double now_s = steady_now_s();
    if (!topic.changed || (!all && now_s < topic.due_s)) return;
    topic.changed = false;
    topic.due_s = now_s + static_cast<double>(publish_it()) / options_.state_bytes_per_s;
  };
  publish_if_due(path_, [this] { return publish_path(keyframe_poses()); });
  publish_if_due(mesh_, [this] { return publish_mesh(); });
  publish_if_due(objects_, [this] {
    return publish(objects_.topic, object_markers(newest_objects_->objects, *options_.objects,
                                                  {stamp_.value_or(0), map_}));
  });
  publish_if_due(map_2d_, [this] {
    return publish(map_2d_.topic, message_of(*newest_map_2d_, {stamp_.value_or(0), map_}));
  });
  if (!options_.draws) return;
  publish_if_due(closures_, [this] {
    return publish(closures_.topic,
                   closure_lines(newest_closures_, *trajectory_, {stamp_.value_or(0), map_}));
  });
}

std::vector<StampedPose> RosOutputNode::keyframe_poses() const {
  const auto& stamps = frames_.keyframe_stamps();
  std::vector<StampedPose> poses;
  for (std::size_t k = 0; k < std::min(stamps.size(), trajectory_->T_world_kf.size()); ++k)
    poses.push_back({stamps[k], trajectory_->T_world_kf[k]});
  return poses;
}

std::size_t RosOutputNode::publish_path(std::span<const StampedPose> poses) {
  if (poses.empty()) return 0;
  RosPath path{{stamp_.value_or(poses.back().stamp), map_}, {}};
  for (const StampedPose& pose : poses)
    path.poses.push_back({{pose.stamp, map_}, message_of(pose.T)});
  return publish(path_.topic, path);
}

std::size_t RosOutputNode::publish_mesh() {
  const RosHeader header{stamp_.value_or(0), map_};
  std::size_t bytes = publish(
      mesh_.topic, cloud_of(*newest_mesh_, static_cast<std::size_t>(options_.mesh_points), header));
  if (options_.draws)
    bytes += publish(faces_, surface_of(*newest_mesh_, newest_mesh_->faces, header));
  return bytes;
}

// Sends as many pieces of the mesh as RosOutputOptions::mesh_bytes_per_s allows now.
void RosOutputNode::publish_pieces() {
  const double now_s = steady_now_s();
  while (piece_bytes_.wait_s(0.0, now_s) <= 0.0) {
    const auto piece = pieces_.next({stamp_.value_or(0), map_});
    if (!piece) return;
    piece_bytes_.spend(static_cast<double>(publish(faces_, *piece)), now_s);
  }
}

// Before robots have joined a session, no transform between their frames is known.
void RosOutputNode::publish_team_frame() {
  const std::string team = map_of(trajectory_->anchor);
  if (trajectory_->T_world_kf.empty() || team == map_) return;
  publish(tf_, RosTFMessage{{{{stamp_.value_or(0), team}, map_, {}}}});
}

RosDiagnosticStatus RosOutputNode::odometry_status() const {
  RosDiagnosticStatus status;
  status.name = name_ + ": odometry";
  status.hardware_id = name_;
  const double age_s = steady_now_s() - stamp_arrived_s_;
  if (poses_ == 0 || age_s > kLate_s) status.level = RosLevel::kWarn;
  status.message = poses_ == 0       ? "no image has a pose yet"
                   : age_s > kLate_s ? "no pose for " + fixed(age_s, 1) + " s"
                                     : "ok";
  status.values = {{"poses", std::to_string(poses_)},
                   {"keyframes", std::to_string(frames_.keyframe_stamps().size())},
                   {"stamp of the last [ns]", std::to_string(stamp_.value_or(0))},
                   {"speed [m/s]", fixed(speed_mps_, 3)}};
  return status;
}

void RosOutputNode::publish_diagnostics(std::vector<RosDiagnosticStatus> parts) {
  for (RosDiagnosticStatus& status : parts) {
    status.name = name_ + ": " + status.name;
    status.hardware_id = name_;
  }
  parts.insert(parts.begin(), odometry_status());
  publish(diagnostics_, RosDiagnosticArray{{stamp_.value_or(0), ""}, std::move(parts)});
}

void RosOutputNode::step(const Tick& /*tick*/) {
  publish_diagnostics(diagnose_());
  if (auto closures = options_.draws ? closures_of_() : std::nullopt) {
    newest_closures_ = *std::move(closures);
    closures_.changed = true;
  }
  publish_latest(false);
  publish_pieces();
  publish_team_frame();
  sink_->flush();
}

void RosOutputNode::finish(std::span<const StampedPose> poses,
                           std::optional<std::vector<PublishedClosure>> closures,
                           const std::map<std::string, std::string>& files) {
  if (closures && options_.draws) {
    newest_closures_ = *std::move(closures);
    closures_.changed = true;
  }
  path_.changed = path_.changed && poses.empty();
  publish_latest(true);
  if (!poses.empty()) publish_path(poses);
  publish_team_frame();
  for (const auto& [name, text] : files) sink_->attach(name, text);
  sink_->finish();
}

}  // namespace km

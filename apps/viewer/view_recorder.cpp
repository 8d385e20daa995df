#include "apps/viewer/view_recorder.hpp"

#include <chrono>
#include <functional>
#include <stdexcept>
#include <utility>
#include <variant>

#include "modules/core/stamped_pose.hpp"
#include "modules/core/text_table.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/node/ros_output_node.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueue = 10000;         // as in the record of a robot
constexpr double kState_bytes_per_s = 200e3;  // rate of uncompressed paths, meshes and closures
constexpr int kMeshPoints = 200000;
constexpr double kMeshPeriod_s = 5.0;           // because merging the chunks of a mesh takes long
constexpr double kMaxVelocityInterval_s = 1.0;  // poses farther apart in time give no velocity

RosDiagnosticStatus status_of(const RobotSample& state) {
  RosDiagnosticStatus status;
  status.name = "robot";
  status.message = state.phase;
  status.values = {{"keyframes", std::to_string(state.keyframes)},
                   {"skipped frames", std::to_string(state.skipped_frames)},
                   {"cost", rounded(state.cost, 6)},
                   {"cpu [s]", fixed(state.cpu_s, 2)},
                   {"memory [MB]", fixed(state.resident_MB, 1)}};
  for (const NamedNumber& sent : state.sent_bytes)
    status.values.push_back({"sent: " + sent.name + " [B]", fixed(sent.value, 0)});
  for (const NamedNumber& load : state.loads)
    status.values.push_back({"load: " + load.name, fixed(load.value, 3)});
  return status;
}

// Sets or appends an element; true if it was appended.
template <typename T>
bool put(std::vector<T>& list, std::size_t index, const T& value) {
  if (index < list.size()) list[index] = value;
  if (index != list.size()) return false;
  list.push_back(value);
  return true;
}

}  // namespace

// The common file of all robots. Each robot writes to it on a thread of its own.
struct ViewRecorder::File {
  explicit File(const std::filesystem::path& file)
      : sink(file, [this, file](const std::string& why) {
          failure = file.string() + ": " + why;
          log::error("viewer") << failure;
        }) {}

  std::mutex mutex;  // guards the members below
  std::string failure;
  McapSink sink;
};

// Sink for the messages of one robot.
class ViewRecorder::Sink final : public RosSink {
 public:
  explicit Sink(std::shared_ptr<File> file) : file_(std::move(file)) {}

  std::size_t open(const PublishedTopic& topic) override {
    const std::lock_guard lock(file_->mutex);
    return file_->sink.open(topic);
  }
  void put(std::size_t topic, std::optional<Stamp> time,
           std::span<const std::uint8_t> message) override {
    const std::lock_guard lock(file_->mutex);
    file_->sink.put(topic, time, message);
  }
  void flush() override {
    const std::lock_guard lock(file_->mutex);
    file_->sink.flush();
  }

 private:
  std::shared_ptr<File> file_;
};

// Messages of one process of a robot.
class ViewRecorder::Robot {
 public:
  Robot(RobotId id, std::uint64_t process) : boot(process) {
    trajectory.robot = trajectory.anchor = id;
  }

  // From now on messages are written, beginning with those received so far.
  void begin(const std::string& name, const std::shared_ptr<File>& file,
             const LabelPalette& palette, double gone_s,
             const std::function<std::string(RobotId)>& name_of) {
    images_ = std::make_unique<Sink>(file);
    image_topic_ = images_->open(
        {'/' + ros_name(name) + "/left/image_raw/compressed", RosCompressedImage::kType});
    camera_ = ros_name(name) + "/left_camera";
    node_.emplace(
        "record", std::make_unique<Sink>(file),
        RosOutputOptions{.robot = name,
                         .id = trajectory.robot,
                         .name_of = name_of,
                         .mesh_points = kMeshPoints,
                         .objects = palette,
                         .draws = true,
                         .state_bytes_per_s = kState_bytes_per_s,
                         .queue = kQueue},
        [this, gone_s]() -> std::optional<std::vector<RosDiagnosticStatus>> {
          const std::lock_guard lock(mutex_);
          if (has_left_ || steady_now_s() - last_received_s_ > gone_s) return std::nullopt;
          return std::vector<RosDiagnosticStatus>{status_};
        },
        [this] {
          const std::lock_guard lock(mutex_);
          return std::exchange(closures_now_, std::nullopt);
        },
        RosOutputTopics{odometry_topic_, keyframe_topic_, trajectory_topic_, std::nullopt});
    node_->start();
    for (std::size_t k = 0; k < odometry.size(); ++k) publish_keyframe(k);
    if (!trajectory.T_world_kf.empty()) trajectory_topic_.publish(trajectory);
  }
  [[nodiscard]] bool has_begun() const { return node_.has_value(); }

  // Notes that a message of the robot arrived.
  void receive() {
    const std::lock_guard lock(mutex_);
    last_received_s_ = steady_now_s();
  }

  void receive(const RobotSample& state) {
    const std::lock_guard lock(mutex_);
    status_ = status_of(state);
    has_left_ = state.phase == "leaving";
  }

  void receive(const ViewPose& pose) { publish_state(pose.stamp, pose.T_odom_body); }

  void receive(const ViewKeyframes& keyframes) {
    if (keyframes.optimized &&
        keyframes.anchor != std::exchange(trajectory.anchor, keyframes.anchor))
      trajectory.T_world_kf.clear();
    for (std::size_t k = 0; k < keyframes.T_world_kf.size(); ++k) {
      const std::size_t index = keyframes.first + k;
      if (keyframes.optimized)
        put(trajectory.T_world_kf, index, keyframes.T_world_kf[k]);
      else if (put(odometry, index, StampedPose{keyframes.stamps[k], keyframes.T_world_kf[k]}))
        publish_keyframe(index);
    }
    if (keyframes.optimized) trajectory_topic_.publish(trajectory);
  }

  void receive(const ViewClosures& update) {
    for (const ViewClosure& closure : update.closures) closures[closure.id] = closure;
  }

  void receive(const MeshChunk& chunk) {
    mesh_changed_ |= mesh_.add(chunk) == ChunkVerdict::kTaken;
  }

  void receive(const ViewObjects& objects) { objects_ = objects; }

  void receive(const ViewRaster& raster) {
    if (raster.kind == RasterKind::kOccupancy)
      map_2d_ = raster;
    else if (node_ && newest_)
      node_->offer_slice(std::make_shared<const LabelledMesh>(distance_points(raster)),
                         newest_->stamp);
  }

  void receive(const ViewImage& image) {
    if (!images_) return;
    images_->put(image_topic_, image.stamp,
                 encode_ros(RosCompressedImage{{image.stamp, camera_}, "jpeg", image.jpeg}));
  }

  void publish_closures(std::vector<PublishedClosure> now) {
    const std::lock_guard lock(mutex_);
    closures_now_ = std::move(now);
  }

  // Writes new objects and a new 2D map once the path is in the same frame.
  void publish_layers() {
    if (!node_) return;
    if (objects_ && objects_->anchor == trajectory.anchor) {
      node_->offer(std::make_shared<const ObjectList>(object_list(*objects_)));
      objects_.reset();
    }
    if (map_2d_ && map_2d_->anchor == trajectory.anchor) {
      node_->offer(std::make_shared<const OccupancyGrid>(occupancy_grid(*map_2d_)));
      map_2d_.reset();
    }
  }

  // Writes the present mesh if it has changed and is due.
  void publish_mesh(const LabelPalette& palette, double now_s) {
    if (!mesh_changed_ || !node_ || now_s < mesh_due_s_) return;
    mesh_changed_ = false;
    mesh_due_s_ = now_s + kMeshPeriod_s;
    std::vector<RobotMesh> known = mesh_.snapshot();
    if (known.empty()) return;
    LabelledMesh& mesh = known.front().mesh;
    if (!palette.classes().empty()) mesh.colour_by(palette);
    node_->offer(std::make_shared<const LabelledMesh>(std::move(mesh)));
  }

  // Ends the output and returns the number of messages that were left out.
  std::size_t finish(const LabelPalette& palette) {
    if (!node_) return 0;
    mesh_due_s_ = 0.0;
    publish_mesh(palette, steady_now_s());
    publish_layers();
    node_->stop();
    node_->finish({}, std::exchange(closures_now_, std::nullopt), {});
    return node_->dropped();
  }

  const std::uint64_t boot;
  std::vector<StampedPose> odometry;  // odometry poses of keyframes
  Trajectory trajectory;
  std::map<ClosureId, ViewClosure> closures;

 private:
  void publish_state(Stamp stamp, const SE3& T_odom_body) {
    OdometryState state{.stamp = stamp, .T_odom_body = T_odom_body};
    const double dt_s = newest_ ? seconds_between(newest_->stamp, stamp) : 0.0;
    if (dt_s > 0.0 && dt_s < kMaxVelocityInterval_s)
      state.v_odom = (T_odom_body.translation() - newest_->T.translation()) / dt_s;
    if (!newest_ || dt_s > 0.0) newest_ = StampedPose{stamp, T_odom_body};
    odometry_topic_.publish(std::move(state));
  }

  // Publishes the state of the keyframe's image first, because LiveFrames takes the odometry pose
  // of the keyframe from this state.
  void publish_keyframe(std::size_t index) {
    const auto& [stamp, T_odom_kf] = odometry[index];
    publish_state(stamp, T_odom_kf);
    KeyframeOdometry keyframe;
    keyframe.id = {trajectory.robot, static_cast<KeyframeIndex>(index)};
    keyframe.stamp = stamp;
    keyframe.T_odom_kf = T_odom_kf;
    keyframe_topic_.publish(std::move(keyframe));
  }

  Topic<OdometryState> odometry_topic_;
  Topic<KeyframeOdometry> keyframe_topic_;
  Topic<Trajectory> trajectory_topic_;
  std::optional<StampedPose> newest_;
  TeamMesh mesh_;
  bool mesh_changed_ = false;
  double mesh_due_s_ = 0.0;
  std::optional<ViewObjects> objects_;  // not published yet
  std::optional<ViewRaster> map_2d_;    // not published yet
  std::unique_ptr<Sink> images_;
  std::size_t image_topic_ = 0;
  std::string camera_;
  std::mutex mutex_;  // guards the members that the node reads
  RosDiagnosticStatus status_;
  double last_received_s_ = 0.0;  // time of the last message, by the steady clock
  bool has_left_ = false;
  std::optional<std::vector<PublishedClosure>> closures_now_;
  std::optional<RosOutputNode> node_;  // last member: stops first
};

ViewRecorder::ViewRecorder(const std::filesystem::path& file, LabelPalette palette, double gone_s)
    : palette_(std::move(palette)),
      gone_s_(gone_s),
      file_(std::make_shared<File>(file)),
      worker_(
          kQueue, Overflow::kDropOldest, [this](const Input& update) { step(update); }, "record"),
      clock_(
          std::chrono::seconds(1), [this] { worker_.post(std::nullopt); }, "record tick") {
  worker_.start();
  clock_.start();
}

ViewRecorder::~ViewRecorder() {
  clock_.stop();
  worker_.stop();
}

void ViewRecorder::step(const Input& update) {
  if (!update) {
    const bool changed = std::exchange(closures_changed_, false);
    for (auto& [id, robot] : robots_) {
      if (changed) robot->publish_closures(closures_of(*robot));
      robot->publish_mesh(palette_, steady_now_s());
      robot->publish_layers();
    }
    return;
  }
  Robot& robot = robot_of(*update);
  robot.receive();
  const auto* const state = std::get_if<RobotSample>(&update->content);
  if (state != nullptr && !robot.has_begun()) {
    {
      const std::lock_guard lock(mutex_);
      names_[update->robot] = state->name;
    }
    robot.begin(state->name, file_, palette_, gone_s_, [this](RobotId id) { return name_of(id); });
  }
  const auto* const keyframes = std::get_if<ViewKeyframes>(&update->content);
  closures_changed_ |= std::holds_alternative<ViewClosures>(update->content) ||
                       (keyframes != nullptr && keyframes->optimized);
  std::visit([&](const auto& content) { robot.receive(content); }, update->content);
}

// Replaces the robot if the update comes from a new process of it.
ViewRecorder::Robot& ViewRecorder::robot_of(const ViewUpdate& update) {
  auto& robot = robots_[update.robot];
  if (robot != nullptr && robot->boot != update.boot) finish_robot(*std::exchange(robot, nullptr));
  if (robot == nullptr) robot = std::make_unique<Robot>(update.robot, update.boot);
  return *robot;
}

std::string ViewRecorder::name_of(RobotId robot) const {
  const std::lock_guard lock(mutex_);
  const auto known = names_.find(robot);
  return known != names_.end() ? known->second : "robot" + std::to_string(robot);
}

std::vector<PublishedClosure> ViewRecorder::closures_of(const Robot& robot) const {
  const auto pose_of = [&](const KeyframeId& keyframe) -> const SE3* {
    const auto known = robots_.find(keyframe.robot);
    if (known == robots_.end() || known->second == nullptr) return nullptr;
    const Trajectory& trajectory = known->second->trajectory;
    const bool is_there = trajectory.anchor == robot.trajectory.anchor &&
                          keyframe.index < trajectory.T_world_kf.size();
    return is_there ? &trajectory.T_world_kf[keyframe.index] : nullptr;
  };
  std::vector<PublishedClosure> published;
  for (const auto& [id, closure] : robot.closures) {
    PublishedClosure& one = published.emplace_back(PublishedClosure{id, closure.verdict, {}});
    const SE3* const from = pose_of(id.from);
    const SE3* const to = pose_of(id.to);
    if (from != nullptr && to != nullptr) one.T_from_to = from->inverse() * *to;
  }
  return published;
}

void ViewRecorder::finish_robot(Robot& robot) {
  if (closures_changed_) robot.publish_closures(closures_of(robot));
  missing_updates_ += robot.finish(palette_);
}

void ViewRecorder::finish() {
  clock_.stop();
  worker_.stop();
  if (worker_.error() != nullptr) std::rethrow_exception(worker_.error());
  for (auto& [id, robot] : robots_) finish_robot(*robot);
  const std::lock_guard lock(file_->mutex);
  file_->sink.finish();
  missing_updates_ += worker_.load().dropped;
  if (!file_->failure.empty()) throw std::runtime_error(file_->failure);
  if (missing_updates_ > 0)
    throw std::runtime_error("the record lacks " + std::to_string(missing_updates_) +
                             " updates: they came faster than they were written");
}

}  // namespace km

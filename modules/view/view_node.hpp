#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/closure_verdicts.hpp"
#include "modules/core/tracked_image.hpp"
#include "modules/mesh/chunk_schedule.hpp"
#include "modules/view/view_channel_codec.hpp"
#include "modules/view/view_config.hpp"
#include "modules/view/view_teller.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/token_bucket.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of what is told to those who watch; they must outlive it.
struct ViewTopics {
  In<OdometryState> odometry;
  In<KeyframeOdometry> keyframes;
  In<Trajectory> trajectory;
  In<OptimizerProgress> progress;
  In<ClosureOutcome> outcomes, restored_outcomes;
  In<Closure> closures;  ///< Of both ends.
  In<InlierSet> own_inlier_sets, peer_inlier_sets;
  In<ClosureVerdicts> verdicts;
  In<PeerEvent> restarts;
  In<RobotStatus> statuses;
  In<TrackedImage> images;
};

/// How a mesh is cut into what is told.
struct ViewMesh {
  ChunkGrid grid;
  double min_move_m = 0.01;  ///< See differ().
};

/// Tells those who watch how the robot does (see ViewUpdate), on topics of its own in the team's
/// domain: what a ViewTeller gives, a state once a second, the mesh in chunks, and camera images
/// if they are asked for. Each within its budget, and only while somebody reads it: else what
/// comes is only kept. Nobody waits for who watches; what DDS cannot take is lost to them.
class ViewNode final : public Node {
 public:
  /// All of a state but anchor, round, cost, gradient and links. Called on the node's thread.
  using Describe = std::function<ViewState()>;

  /// `participant` outlives it. Throws ConfigError if `config` is out of bounds. `camera`: of the
  /// images; without one, none are told.
  ViewNode(const ViewConfig& config, const DdsParticipant& participant, const ViewMesh& mesh,
           const std::optional<Camera>& camera, Describe describe, const ViewTopics& topics);
  ~ViewNode() override { stop(); }

  /// The newest mesh counts, in the frame of the robot `anchor`. Thread-safe; does not wait.
  void offer(RobotId anchor, std::shared_ptr<const LabelledMesh> mesh);

  std::string_view name() const override { return ViewConfig::kSection; }
  void start() override;
  /// Tells what is left, up to two seconds' worth of the budget, and ten of that for the mesh.
  void stop() noexcept override;
  std::exception_ptr error() const override;
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }
  /// A thin link may hold up the socket for as long.
  double step_limit_s() const override { return 120.0; }

  struct Tick {};
  struct MeshOffer {
    RobotId anchor = 0;
    std::shared_ptr<const LabelledMesh> mesh;
  };
  using Input = std::variant<
      Tick, MeshOffer, Topic<OdometryState>::Message, Topic<KeyframeOdometry>::Message,
      Topic<Trajectory>::Message, Topic<OptimizerProgress>::Message, Topic<ClosureOutcome>::Message,
      Topic<Closure>::Message, Topic<InlierSet>::Message, Topic<ClosureVerdicts>::Message,
      Topic<PeerEvent>::Message, Topic<RobotStatus>::Message, Topic<TrackedImage>::Message>;

  /// Keeps what comes; a Tick tells what is due by the steady clock. The thread calls only this.
  void step(const Input& input);

  /// Tells what is due at `now_s`.
  void tell(double now_s);

  /// Bytes told since the start, on that channel. Thread-safe.
  [[nodiscard]] std::size_t told_bytes(ViewChannel channel) const;

 private:
  /// One channel, what it may take, and what it took.
  struct Channel {
    ViewWriter writer;
    TokenBucket budget;
    std::atomic<std::size_t> told_bytes = 0;
  };

  // What comes is kept.
  void take(const Tick& tick);
  void take(const MeshOffer& offer);
  void take(const Topic<OptimizerProgress>::Message& progress) { progress_ = progress; }
  void take(const Topic<Trajectory>::Message& trajectory) { teller_.add(trajectory); }
  void take(const Topic<PeerEvent>::Message& event);
  void take(const Topic<RobotStatus>::Message& status);
  void take(const Topic<TrackedImage>::Message& image);
  template <typename T>
  void take(const std::shared_ptr<const T>& message) {
    teller_.add(*message);
  }

  [[nodiscard]] Channel& on(ViewChannel channel) {
    return channels_[static_cast<std::size_t>(channel)];
  }
  [[nodiscard]] TokenBucket& view_budget();
  void tell_view(double now_s);
  void tell_mesh(double now_s);
  void cut_mesh(double now_s);
  void tell_rest();
  [[nodiscard]] ViewState state(double now_s);
  std::size_t write(Channel& channel, const ViewContent& content);

  const ViewConfig config_;
  const RobotId self_;
  const ViewMesh mesh_settings_;
  const std::optional<Camera> camera_;
  const Describe describe_;
  std::array<Channel, 3> channels_;
  TokenBucket past_budget_;  // of kView, while the past is told
  ViewTeller teller_;
  double state_due_s_ = 0.0;
  Topic<OptimizerProgress>::Message progress_;
  std::map<RobotId, double> heard_s_;  // of each robot, when last
  MeshOffer mesh_;                     // the newest
  bool is_cut_ = true;                 // it is in the schedule
  double cut_due_s_ = 0.0;
  bool tells_mesh_ = false;  // somebody reads it
  ChunkSchedule schedule_;
  std::atomic<bool> are_images_asked_ = false;
  bool stopped_ = false;
  Worker<Input> worker_;
  Periodic ticks_;  // last member: stops before the worker it posts to
};

}  // namespace km

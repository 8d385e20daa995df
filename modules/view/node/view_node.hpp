#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <variant>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/tracked_image.hpp"
#include "modules/core/data/closure_verdicts.hpp"
#include "modules/mesh/chunk_schedule.hpp"
#include "modules/view/node/view_channel_codec.hpp"
#include "modules/view/view_config.hpp"
#include "modules/view/view_layers.hpp"
#include "modules/view/view_selector.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/token_bucket.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels with the inputs for viewers; they must outlive the node.
struct ViewTopics {
  In<OdometryState> odometry;
  In<KeyframeOdometry> keyframes;
  In<ClosureOutcome> outcomes, restored_outcomes;
  In<Closure> closures;  ///< Closures of both ends.
  In<PeerEvent> restarts;
  In<ObjectList> objects;
  In<OccupancyGrid> maps_2d;
  In<TrackedImage> images;
};

/// A mesh in the frame of the robot `anchor`.
struct ViewMeshOffer {
  RobotId anchor = 0;
  std::shared_ptr<const LabelledMesh> mesh;
};
using ViewInput = std::variant<
    Tick, ViewMeshOffer, Topic<OdometryState>::Message, Topic<KeyframeOdometry>::Message,
    Topic<ClosureOutcome>::Message, Topic<Closure>::Message, Topic<ClosureJudgements>::Message,
    Topic<PoseChanges>::Message, Topic<RobotSample>::Message, Topic<PeerEvent>::Message,
    Topic<ObjectList>::Message, Topic<OccupancyGrid>::Message, Topic<TrackedImage>::Message>;

/// Sends the state of the robot to viewers (see ViewUpdate), on topics of its own in the team's
/// domain. It sends the updates of a ViewSelector, the mesh in chunks, the updates of ViewLayers,
/// and camera images on request. Images have a rate, other topics a budget. While a topic has no
/// reader, the node only keeps the newest inputs. No node waits for a viewer; updates that DDS
/// cannot accept are lost.
class ViewNode final : public WorkerNode<ViewInput> {
 public:
  /// `participant` outlives this. Throws ConfigError if `config` is out of bounds. `camera` belongs
  /// to the images; without it no images are sent.
  ViewNode(const ViewConfig& config, const DdsParticipant& participant,
           const std::optional<Camera>& camera, const ViewTopics& topics);
  ~ViewNode() override { stop(); }

  /// Replaces the mesh, given in the frame of the robot `anchor`. Thread-safe; does not wait.
  void offer(RobotId anchor, std::shared_ptr<const LabelledMesh> mesh);

  /// Sends an event of the recorder: ClosureJudgements, PoseChanges or RobotSample. Thread-safe;
  /// does not wait.
  template <typename Event>
  void offer(const Event& event) {
    post(std::make_shared<const Event>(event));
  }

  /// Stores an input; a Tick sends the updates that are due by the steady clock. The thread calls
  /// only this.
  void step(const Input& input);

  /// Sends the updates that are due at `now_s`.
  void send_due(double now_s);

  /// Bytes sent on that channel since the start. Thread-safe.
  [[nodiscard]] std::size_t sent_bytes(ViewChannel channel) const;

 private:
  /// One channel with its byte budget and the bytes it has sent.
  struct Channel {
    ViewWriter writer;
    TokenBucket budget;
    std::atomic<std::size_t> sent_bytes = 0;
  };

  void handle(const Input& input) override { step(input); }
  /// Sends the remaining updates: at most two seconds at ViewConfig::past_bytes_per_s, and ten
  /// seconds at mesh_bytes_per_s for the map.
  void conclude() override;
  // Each take() stores an input, except for a Tick, which sends.
  void take(const Tick& tick);
  void take(const ViewMeshOffer& offer);
  void take(const Topic<PeerEvent>::Message& event);
  void take(const Topic<ObjectList>::Message& objects) { layers_.add(objects); }
  void take(const Topic<OccupancyGrid>::Message& map) { layers_.add(map); }
  void take(const Topic<TrackedImage>::Message& image);
  template <typename T>
  void take(const std::shared_ptr<const T>& message) {
    selector_.add(*message);
  }

  [[nodiscard]] Channel& on(ViewChannel channel) {
    return channels_[static_cast<std::size_t>(channel)];
  }
  [[nodiscard]] TokenBucket& view_budget();
  void send_view(double now_s);
  void send_map(double now_s);
  [[nodiscard]] std::optional<ViewContent> next_of_map(double now_s);
  void cut_mesh(double now_s);
  void send_rest();
  void follow_participant();
  std::size_t write(Channel& channel, const ViewContent& content);

  const ViewConfig config_;
  const DdsParticipant& participant_;
  const RobotId self_;
  const std::optional<Camera> camera_;
  std::array<Channel, 3> channels_;
  std::uint64_t moves_ = 0;  // Moves of the participant to which the writers belong.
  TokenBucket past_budget_;  // Budget of kView while earlier data are sent.
  ViewSelector selector_;
  ViewMeshOffer mesh_;  // The newest mesh.
  bool is_cut_ = true;  // True if `mesh_` is in the schedule.
  double cut_due_s_ = 0.0;
  std::atomic<bool> sends_mesh_ = false;  // True if the mesh channel has a reader.
  ChunkSchedule schedule_{kMinChunkMove_m};
  ViewLayers layers_;
  std::atomic<bool> are_images_asked_ = false;
};

}  // namespace km

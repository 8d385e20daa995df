#include "modules/view/node/view_node.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "modules/mesh/mesh_file.hpp"
#include "modules/view/view_content.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueue = 4096;  // The oldest inputs are dropped, so that no node waits for a
                                      // viewer.
constexpr double kTick_s = 0.1;
constexpr double kBurst_s = 0.5;          // Time for which unused budget is kept.
constexpr double kRest_s = 2.0;           // Budget for the end, in seconds of its rate.
constexpr double kMeshRest_s = 10.0;      // Budget for the mesh at the end, large enough for its
                                          // last correction.
constexpr double kAcknowledged_s = 0.5;   // Timeout for the acknowledgements of these last updates.
constexpr double kLayerShare = 0.25;      // Maximum share of the budget of the map for layers.
constexpr double kCutShare = 1.0 / 30.0;  // Maximum share of the time for splitting the mesh.

ViewWriter writer_on(const DdsParticipant& participant, ViewChannel channel) {
  const RobotIdentity& self = participant.identity();
  return {participant.handle(), channel, TeamPeer{self.robot, self.boot}};
}

TokenBucket budget_of(double bytes_per_s) {
  return {bytes_per_s, kBurst_s * bytes_per_s, kBurst_s * bytes_per_s};
}

// Images are sent at the configured rate and have no byte budget.
constexpr double kUnlimited = std::numeric_limits<double>::infinity();

}  // namespace

ViewNode::ViewNode(const ViewConfig& config, const DdsParticipant& participant,
                   const std::optional<Camera>& camera, const ViewTopics& topics)
    : WorkerNode({.name = ViewConfig::kSection,
                  .queue = kQueue,
                  .overflow = Overflow::kDropOldest,
                  .tick_s = kTick_s}),
      config_(checked(config)),
      participant_(participant),
      self_(participant.identity().robot),
      camera_(camera),
      channels_{{{writer_on(participant, ViewChannel::kView), budget_of(config.bytes_per_s)},
                 {writer_on(participant, ViewChannel::kMesh), budget_of(config.mesh_bytes_per_s())},
                 {writer_on(participant, ViewChannel::kImages), budget_of(kUnlimited)}}},
      past_budget_(budget_of(config.past_bytes_per_s())),
      selector_(self_),
      layers_(kLayerShare * config.mesh_bytes_per_s()) {
  follow(topics.odometry, topics.keyframes, topics.outcomes, topics.restored_outcomes,
         topics.closures, topics.restarts, topics.objects, topics.maps_2d);
  if (!camera_ || config_.images_per_s <= 0.0) return;
  topics.images.subscribe([this, due_s = 0.0](const auto& image) mutable {
    const double now_s = steady_now_s();
    if (!are_images_asked_ || now_s < due_s) return;
    due_s = now_s + 1.0 / config_.images_per_s;
    post(image);
  });
}

void ViewNode::offer(RobotId anchor, std::shared_ptr<const LabelledMesh> mesh) {
  post(ViewMeshOffer{anchor, std::move(mesh)});
}

void ViewNode::conclude() try { send_rest(); } catch (const std::exception& error) {
  log::warn(name()) << "the final state was not sent: " << error.what();
}

std::size_t ViewNode::sent_bytes(ViewChannel channel) const {
  return channels_[static_cast<std::size_t>(channel)].sent_bytes;
}

// Makes the writers again with the participant. Their readers are newcomers then, which receive
// all.
void ViewNode::follow_participant() {
  if (std::exchange(moves_, participant_.moves()) == participant_.moves()) return;
  for (const ViewChannel channel : {ViewChannel::kView, ViewChannel::kMesh, ViewChannel::kImages})
    on(channel).writer = writer_on(participant_, channel);
}

void ViewNode::step(const Input& input) {
  const auto use = participant_.use();
  follow_participant();
  std::visit([this](const auto& message) { take(message); }, input);
}

void ViewNode::take(const Tick& /*tick*/) {
  send_due(steady_now_s());
}

void ViewNode::take(const ViewMeshOffer& offer) {
  mesh_ = offer;
  is_cut_ = false;
}

void ViewNode::take(const Topic<PeerEvent>::Message& event) {
  if (event->kind == PeerEventKind::kRestarted) selector_.restarted(event->identity.robot);
}

void ViewNode::take(const Topic<TrackedImage>::Message& image) {
  write(on(ViewChannel::kImages), view_image(*image, *camera_));
}

void ViewNode::send_due(double now_s) {
  are_images_asked_ = on(ViewChannel::kImages).writer.readers() > 0;
  send_view(now_s);
  send_map(now_s);
}

TokenBucket& ViewNode::view_budget() {
  return selector_.sends_past() ? past_budget_ : on(ViewChannel::kView).budget;
}

// An update is sent while the budget has no debt, and may itself cause a debt.
void ViewNode::send_view(double now_s) {
  Channel& view = on(ViewChannel::kView);
  if (view.writer.newcomers() > 0) selector_.begin_again();
  if (view.writer.readers() == 0) return;
  while (view_budget().wait_s(0.0, now_s) <= 0.0) {
    TokenBucket& budget = view_budget();  // Budget of the update that follows.
    const std::optional<ViewContent> content = selector_.next(now_s);
    const std::size_t bytes = content ? write(view, *content) : 0;
    if (bytes == 0) return;
    budget.spend(static_cast<double>(bytes), now_s);
  }
}

std::optional<ViewContent> ViewNode::next_of_map(double now_s) {
  if (auto layer = layers_.next(now_s)) return layer;
  if (auto chunk = schedule_.next()) return *std::move(chunk);
  return std::nullopt;
}

void ViewNode::send_map(double now_s) {
  Channel& mesh = on(ViewChannel::kMesh);
  const bool has_newcomers = mesh.writer.newcomers() > 0;
  const bool sent_before = sends_mesh_.exchange(mesh.writer.readers() > 0);
  if (has_newcomers || (sent_before && !sends_mesh_)) {
    schedule_.begin_again();
    layers_.begin_again();
    is_cut_ = mesh_.mesh == nullptr;
    cut_due_s_ = now_s;
  }
  if (!sends_mesh_) return;
  if (!is_cut_ && now_s >= cut_due_s_) cut_mesh(now_s);
  while (mesh.budget.wait_s(0.0, now_s) <= 0.0) {
    const std::optional<ViewContent> content = next_of_map(now_s);
    const std::size_t bytes = content ? write(mesh, *content) : 0;
    if (bytes == 0) return;
    mesh.budget.spend(static_cast<double>(bytes), now_s);
  }
}

// Splitting takes longer for a larger mesh, so the interval grows with it. A mesh that cannot be
// split is skipped.
void ViewNode::cut_mesh(double now_s) {
  const double begin_s = steady_now_s();
  is_cut_ = true;
  try {
    std::vector<std::string> notes;
    const LabelledMesh shown = without_far_vertices(*mesh_.mesh, "the mesh", notes);
    for (const std::string& note : notes) log::limited(log::Level::kWarn, name(), "far") << note;
    schedule_.update(split_mesh(shown, self_, mesh_.anchor, ChunkGrid()).chunks);
  } catch (const std::invalid_argument& error) {
    log::limited(log::Level::kWarn, name(), "mesh") << "a mesh is not sent: " << error.what();
  }
  cut_due_s_ = now_s + (steady_now_s() - begin_s) / kCutShare;
}

// Returns the bytes sent, or 0 if DDS refused the update.
std::size_t ViewNode::write(Channel& channel, const ViewContent& content) try {
  const std::size_t bytes = channel.writer.write(content);
  channel.sent_bytes += bytes;
  return bytes;
} catch (const DdsError& error) {
  log::limited(log::Level::kWarn, name(), "dds") << error.what();
  return 0;
}

// Sends the final state to the viewers that are still present.
void ViewNode::send_rest() {
  const auto use = participant_.use();
  follow_participant();
  const double now_s = steady_now_s();
  Channel& view = on(ViewChannel::kView);
  Channel& mesh = on(ViewChannel::kMesh);
  if (view.writer.readers() > 0) {
    double bytes = 0.0;
    const double late_s = now_s + ViewSelector::kKeyframePeriod_s;  // Time at which all updates are
                                                                    // due.
    while (bytes < kRest_s * config_.past_bytes_per_s()) {
      const auto content = selector_.next(late_s);
      if (!content) break;
      bytes += static_cast<double>(write(view, *content));
    }
  }
  if (sends_mesh_) {
    if (!is_cut_) cut_mesh(now_s);
    double bytes = 0.0;
    while (bytes < kMeshRest_s * config_.mesh_bytes_per_s()) {
      const auto content = next_of_map(kUnlimited);
      if (!content) break;
      bytes += static_cast<double>(write(mesh, *content));
    }
    if (schedule_.waiting() > 0)
      log::info(name()) << schedule_.waiting() << " pieces of the last mesh are not sent";
  }
  for (const Channel* channel : {&view, &mesh})
    if (channel->writer.readers() > 0) channel->writer.await_readers(kAcknowledged_s);
}

}  // namespace km

#include "modules/team_map/node/team_map_node.hpp"

#include <string>
#include <utility>
#include <vector>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"
#include "runtime/thread.hpp"

namespace km {
namespace {

// Larger than the number of messages that can arrive while a mesh is fused, so that no sender
// waits.
constexpr std::size_t kQueue = 4096;

constexpr double kCompare_s = 1.0;

// Pause after a comparison, as a multiple of its duration: at most a twentieth of a processor.
constexpr double kPause = 20.0;

}  // namespace

TeamMapNode::TeamMapNode(const TeamMapSettings& settings, LabelPalette palette,
                         const TeamMapTopics& topics)
    : settings_(settings),
      palette_(std::move(palette)),
      own_gone_(topics.own_gone),
      worker_(
          kQueue, Overflow::kBlock,
          [this](const Input& input) {
            work_in_background();
            take(input);
          },
          "team_map"),
      ticks_(
          steady_duration(kCompare_s), [this] { worker_.post(Views()); }, "team map tick") {
  for (const In<MeshChunk>& chunks : {topics.own_chunks, topics.received_chunks})
    chunks.subscribe([this](const auto& chunk) { worker_.post(chunk); });
  for (const In<MeshPoses>& poses : {topics.own_poses, topics.received_poses})
    poses.subscribe([this](const auto& newest) { worker_.post(newest); });
  topics.received_gone.subscribe([this](const auto& gone) { worker_.post(gone); });
}

void TeamMapNode::start() {
  worker_.start();
  ticks_.start();
}

void TeamMapNode::stop() noexcept {
  worker_.stop();
  ticks_.stop();
}

std::exception_ptr TeamMapNode::error() const {
  return worker_.error() != nullptr ? worker_.error() : ticks_.error();
}

void TeamMapNode::offer(Views own) {
  if (settings_.seen_through_views == 0 || own == nullptr) return;
  ++waiting_;
  worker_.post(std::move(own));
}

void TeamMapNode::take(const Input& input) {
  const auto* const own = std::get_if<Views>(&input);
  if (own == nullptr) {
    take_message(input);
  } else if (*own != nullptr) {
    own_ = *own;
    is_due_ = true;
    --waiting_;
    if (!own_->views.empty()) arrivals_.set_newest_view(own_->views.back()->keyframe);
  }
  find_own_gone(steady_now_s());
}

void TeamMapNode::take_message(const Input& input) {
  const std::lock_guard lock(mutex_);
  const auto* const chunk = std::get_if<Topic<MeshChunk>::Message>(&input);
  const auto* const poses = std::get_if<Topic<MeshPoses>::Message>(&input);
  const RobotId robot = chunk != nullptr   ? (*chunk)->key.robot
                        : poses != nullptr ? (*poses)->robot
                                           : std::get<Topic<GoneSurface>::Message>(input)->robot;
  const ChunkVerdict verdict = chunk != nullptr ? chunks_.add(**chunk)
                               : poses != nullptr
                                   ? chunks_.add(**poses)
                                   : chunks_.add(*std::get<Topic<GoneSurface>::Message>(input));
  if (verdict != ChunkVerdict::kTaken) {
    log::limited(log::Level::kWarn, name(), std::to_string(robot))
        << (chunk != nullptr   ? "a chunk of robot "
            : poses != nullptr ? "poses of robot "
                               : "seen-through surface of robot ")
        << robot << " ignored: " << to_string(verdict);
    return;
  }
  if (robot == settings_.self || settings_.seen_through_views == 0) return;
  if (chunk != nullptr) arrivals_.take(**chunk);
  // No view is later than a chunk that has just arrived, so its surface can only end a statement.
  const bool may_end_one = chunk != nullptr && !sent_.blocks.empty();
  if (own_ != nullptr && (poses != nullptr || may_end_one)) is_due_ = true;
}

void TeamMapNode::find_own_gone(double now_s) {
  if (!is_due_ || own_ == nullptr || now_s < next_s_) return;
  GoneSurface gone;
  {
    const std::lock_guard lock(mutex_);
    const std::vector<PlacedChunk> placed = chunks_.placed_of_peers(settings_.self);
    std::vector<TestedChunk> tested;
    for (const PlacedChunk& chunk : placed)
      tested.push_back({&chunk, arrivals_.of(chunk.chunk->key)});
    gone = find_gone(*own_, tested, settings_.seen_through_views, settings_.voxel_m);
    gone.robot = settings_.self;
    if (gone.blocks != sent_.blocks || gone.anchor != sent_.anchor) chunks_.add(gone);
  }
  if (gone.blocks.size() == kMaxGoneBlocks)
    log::limited(log::Level::kWarn, name(), "gone blocks")
        << "surface is seen through in " << kMaxGoneBlocks
        << " blocks of 8 x 8 x 8 voxels or more: that in further blocks stays in the team's mesh";
  if (gone.blocks != sent_.blocks || (gone.anchor != sent_.anchor && !gone.blocks.empty())) {
    sent_ = gone;
    own_gone_.publish(std::move(gone));
  }
  next_s_ = now_s + kPause * (steady_now_s() - now_s);
  is_due_ = false;
}

TeamMap TeamMapNode::fuse() const {
  const std::lock_guard lock(mutex_);
  TeamMap map = fuse_chunks(chunks_.placed(), settings_.voxel_m);
  if (!palette_.classes().empty() && !map.mesh.labels.empty()) map.mesh.colour_by(palette_);
  return map;
}

}  // namespace km

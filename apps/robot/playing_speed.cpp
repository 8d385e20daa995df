#include "apps/robot/playing_speed.hpp"

#include <algorithm>
#include <cmath>

#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "modules/vio/vio.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

constexpr double kMostPlayed_s = 4.0;   // longest part of the recording to play
constexpr double kMostSpent_s = 2.0;    // longest time to spend
constexpr double kLeastPlayed_s = 0.5;  // a shorter part of the recording gives no reliable speed

// Processor time of a whole robot divided by that of odometry and map. In the demo the ratio is 6.0
// s / 5.1 s: place recognition, loop closures, the pose graph, meshes and messages are the
// difference. They come in bursts, so the factor is larger than that ratio.
constexpr double kWholeRobot = 1.5;

// The map as its nodes build it, in the calling thread.
class TrialMap {
 public:
  TrialMap(const StereoRig& rig, const RobotConfig& config, const MappingPlan& plan)
      : sensor_(rig, plan.sensor),
        mapper_(config.semantic_mapping, sensor_.camera(), plan.palette),
        interval_s_(1.0 / config.mapping.rate_hz),
        mesh_interval_s_(config.mapping.mesh_interval_s) {}

  void add(const LocatedFrame& located) {
    const Stamp stamp = located.frame->stamp;
    constexpr double kStampJitter_s = 2e-3;
    if (last_ && seconds_between(*last_, stamp) < interval_s_ - kStampJitter_s) return;
    const DenseImages images = sensor_.sense(*located.frame);
    if (images.problem != DenseProblem::kNone) return;
    last_ = stamp;
    (void)mapper_.integrate(*images.depth, images.labels.get(),
                            located.T_odom_body * located.T_body_rig * sensor_.camera().T_body_cam,
                            located.keyframe);
    if (!meshed_) meshed_ = stamp;
    if (seconds_between(*meshed_, stamp) < mesh_interval_s_) return;
    meshed_ = stamp;
    (void)mapper_.update_mesh();
  }

 private:
  DenseSensor sensor_;
  SemanticMapper mapper_;
  double interval_s_, mesh_interval_s_;
  std::optional<Stamp> last_, meshed_;
};

}  // namespace

std::optional<double> playing_speed(DatasetReader& recording, const RobotConfig& config,
                                    const std::optional<MappingPlan>& mapping) {
  const SensorRig& rig = recording.rig();
  Vio vio(0, rig, config.tracker, config.vio);
  std::optional<TrialMap> map;
  if (mapping) map.emplace(rig.stereo, config, *mapping);
  const double start_s = steady_now_s();
  std::optional<Stamp> first;
  double played_s = 0.0, spent_s = 0.0;
  while (played_s < kMostPlayed_s && spent_s < kMostSpent_s) {
    const std::optional<SensorPacket> packet = recording.next();
    if (!packet) break;
    const VioResult result = vio.process(*packet);
    for (const LocatedFrame& frame : result.frames)
      if (map) map->add(frame);
    if (!first) first = packet->frame->stamp;
    played_s = seconds_between(*first, packet->frame->stamp);
    spent_s = steady_now_s() - start_s;
  }
  if (played_s < kLeastPlayed_s && spent_s < kMostSpent_s) return std::nullopt;
  return played_s / (kWholeRobot * spent_s);
}

double rate_for(std::optional<double> speed) {
  constexpr double kSlowest = 0.1;
  if (!speed || *speed >= 1.0) return 1.0;
  return std::max(kSlowest, std::floor(*speed * 100.0) / 100.0);
}

}  // namespace km

#include "modules/session/own_poses.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>

#include "modules/robust/closure_places.hpp"
#include "modules/robust/corroboration.hpp"
#include "modules/robust/robust_schedule.hpp"
#include "modules/session/frame_entry.hpp"
#include "modules/tree_newton/chordal.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {
namespace {

// Least number of likely closures for a chordal start from noisy odometry; a few closures would
// deform it at random. In tunnels, with five or six likely closures per robot, the team would
// decide on 2.6 % of the closures differently than one session does, instead of on less than 1 %.
// In sphere2500 with 7 times the noise, two of ten seeds have 8 and 94 times the error without the
// chordal start.
constexpr std::size_t kEnoughForChordal = 20;

// True if more than half of the votes of `closures` agree with the poses. O(n log n), unlike the
// search for the transform on which most of them agree.
bool fits(std::span<const PoseEdge> closures, const std::vector<SE3>& poses) {
  const std::vector<double> votes = find_places(closures).votes();
  double agreeing = 0.0, all = 0.0;
  for (std::size_t k = 0; k < closures.size(); ++k) {
    const PoseEdge& e = closures[k];
    const SE3 error = poses[e.to.index].inverse() * poses[e.from.index] * e.T_from_to;
    if (angle_of(error.linear()) <= kAlignedRotation_rad &&
        error.translation().norm() <= kAlignedTranslation_m)
      agreeing += votes[k];
    all += votes[k];
  }
  return 2.0 * agreeing > all;
}

// The cost of `edges`, of which the first `steps` are odometry and the others closures. The cost of
// each closure is truncated.
double truncated_cost(std::span<const PoseEdge> edges, std::size_t steps,
                      const std::vector<SE3>& poses, int dimension) {
  const double barc = default_threshold(dimension);
  double sum = 0.0;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const double r = residual_of(edges[k], poses[edges[k].from.index], poses[edges[k].to.index]);
    sum += k < steps ? r * r : std::min(r * r, barc * barc);
  }
  return sum;
}

// Adds the keyframes without a pose by odometry.
void extend_by_odometry(const OwnGraph& graph, std::vector<SE3>& poses) {
  if (poses.empty()) poses.push_back(graph.T_odom_first());
  while (poses.size() < graph.keyframes())
    poses.push_back(poses.back() * graph.step_to(static_cast<std::uint32_t>(poses.size())));
}

// Moves the poses after each wrong step of odometry as a whole, such that the step is corrected.
void correct(std::span<const OdometryBreak> breaks, std::vector<SE3>& poses) {
  for (const OdometryBreak& found : breaks) {
    const SE3 T_new_old = poses[found.step] * found.T_from_to * poses[found.step + 1].inverse();
    for (std::size_t k = found.step + 1; k < poses.size(); ++k) poses[k] = T_new_old * poses[k];
  }
}

// Moves every later run as a whole to where most of its closures to the runs before it agree,
// unless most of them agree with its place already. False if none has moved.
bool place_runs(const OwnGraph& graph, RobotId self, std::vector<SE3>& poses) {
  bool any = false;
  const std::vector<KeyframeIndex>& runs = graph.later_runs();
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const KeyframeIndex begin = runs[k];
    const KeyframeIndex end = k + 1 < runs.size() ? runs[k + 1] : graph.keyframes();
    std::vector<PoseEdge> across = graph.closures_across(begin, end);
    if (fits(across, poses)) continue;
    // The runs before count as another robot, into whose frame this run moves.
    constexpr RobotId kLast = std::numeric_limits<RobotId>::max();
    const RobotId before = self == kLast ? self - 1 : self + 1;
    std::map<KeyframeId, SE3> received;
    for (PoseEdge& e : across)
      for (KeyframeId* const id : {&e.from, &e.to}) {
        if (id->index >= begin) continue;
        received[{before, id->index}] = poses[id->index];
        id->robot = before;
      }
    const auto moved = moved_into_frame(poses, self, across, received);
    if (!moved) continue;
    any = true;
    const SE3 T_new_old = (*moved)[begin] * poses[begin].inverse();
    for (std::size_t i = begin; i < poses.size(); ++i) poses[i] = T_new_old * poses[i];
  }
  return any;
}

// The closures inside a robot that are likely true before anything is solved. If odometry is noisy,
// these are the closures that its noise explains. Otherwise, these are the closures that agree with
// a closure a few keyframes away.
std::vector<PoseEdge> likely_closures(const OwnGraph& graph, RobotId self,
                                      const std::vector<SE3>& poses,
                                      std::span<const PoseEdge> inside) {
  const std::vector<PoseEdge>& explained = graph.odometry_noise().likely;
  if (!explained.empty()) return explained;
  const std::map<RobotId, Precision> step{{self, graph.mean_step_precision()}};
  const Corroboration::PoseOf pose = [&](const KeyframeId& id) { return poses[id.index]; };
  const std::vector<bool> isolated =
      Corroboration(inside, pose, step, graph.dimension(), {{self, graph.later_runs()}})
          .isolated(default_threshold(graph.dimension()));
  std::vector<PoseEdge> likely;
  for (std::size_t k = 0; k < inside.size(); ++k)
    if (!isolated[k]) likely.push_back(inside[k]);
  return likely;
}

}  // namespace

std::vector<SE3> own_start(const OwnGraph& graph, RobotId self, bool trusted) {
  std::vector<SE3> poses;
  extend_by_odometry(graph, poses);
  correct(graph.odometry_breaks(), poses);
  (void)place_runs(graph, self, poses);
  const std::span<const PoseEdge> inside = graph.newest_edges(self);
  if (inside.empty()) return poses;
  const std::vector<PoseEdge> all = graph.own_edges();
  if (trusted) return better_of_chordal(std::move(poses), all);
  const std::size_t steps = graph.keyframes() - 1;
  std::vector<PoseEdge> likely(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(steps));
  for (const PoseEdge& closure : likely_closures(graph, self, poses, inside))
    likely.push_back(closure);
  if (likely.size() < steps + kEnoughForChordal) return poses;
  std::vector<SE3> chordal = better_of_chordal(poses, likely);
  const auto cost = [&](const std::vector<SE3>& T_odom_kf) {
    return truncated_cost(all, steps, T_odom_kf, graph.dimension());
  };
  return cost(chordal) < cost(poses) ? std::move(chordal) : poses;
}

void OwnPoses::extend(const OwnGraph& graph, RobotId self) {
  while (T_frame_kf_.size() < std::min<std::size_t>(restored_.size(), graph.keyframes()))
    T_frame_kf_.push_back(restored_[T_frame_kf_.size()]);
  extend_by_odometry(graph, T_frame_kf_);
  if (place_runs(graph, self, T_frame_kf_)) covariances_.clear();
}

}  // namespace km

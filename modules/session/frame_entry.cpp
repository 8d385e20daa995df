#include "modules/session/frame_entry.hpp"

#include <cstdint>
#include <utility>

#include "modules/robust/closure_places.hpp"
#include "modules/robust/lone_solution.hpp"
#include "modules/tree_newton/chordal.hpp"
#include "modules/tree_newton/tree_front.hpp"

namespace km {

std::optional<std::vector<SE3>> moved_into_frame(const std::vector<SE3>& poses, RobotId self,
                                                 std::span<const PoseEdge> closures,
                                                 const std::map<KeyframeId, SE3>& received) {
  std::vector<PoseEdge> usable;
  SE3 T_own_centre = SE3::Identity();
  for (const PoseEdge& e : closures) {
    if (!received.contains(e.other(self))) continue;
    usable.push_back(e);
    T_own_centre.translation() += poses[e.end_on(self).index].translation();
  }
  if (usable.empty()) return std::nullopt;
  T_own_centre.translation() /= static_cast<double>(usable.size());
  std::vector<SE3> candidates;
  for (const PoseEdge& e : usable) {
    const SE3& T_frame_other = received.at(e.other(self));
    const SE3 T_other_kf = e.from.robot == self ? e.T_from_to.inverse() : e.T_from_to;
    const SE3& T_own_kf = poses[e.end_on(self).index];
    candidates.push_back(T_frame_other * T_other_kf * T_own_kf.inverse() * T_own_centre);
  }
  const auto alignment = align_frames(candidates, find_places(usable).votes());
  const SE3 T_frame_own = alignment->T * T_own_centre.inverse();
  std::vector<SE3> moved;
  moved.reserve(poses.size());
  for (const SE3& T_own_kf : poses) moved.push_back(T_frame_own * T_own_kf);
  return moved;
}

std::vector<SE3> deformed_to_received(const std::vector<SE3>& poses, RobotId self,
                                      std::span<const PoseEdge> own,
                                      std::span<const PoseEdge> closures,
                                      const std::map<KeyframeId, SE3>& received) {
  constexpr std::uint32_t kMostRounds = 20;
  SessionGraph graph{
      .self = self, .start = poses, .own = {own.begin(), own.end()}, .public_poses = received};
  for (const PoseEdge& e : closures)
    if (received.contains(e.other(self))) graph.to_absent.push_back(e);
  return solve_alone(std::move(graph), {.max_rounds = kMostRounds, .robust = false}).poses;
}

}  // namespace km

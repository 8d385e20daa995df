#include "apps/lab/pgo_study/block_border.hpp"

#include <set>

namespace km {

BlockBorder border_of(const SessionGraph& part) {
  BlockBorder border;
  std::set<KeyframeIndex> own;
  for (const PoseEdge& e : part.between) {
    const KeyframeId& other = e.other(part.self);
    const KeyframeIndex at = e.end_on(part.self).index;
    const auto next = static_cast<Eigen::Index>(border.fixed_of.size());
    const Eigen::Index fixed = border.fixed_of.try_emplace(other, next).first->second;
    border.edges.push_back(
        {at, fixed, e.from.robot == part.self, e.T_from_to, e.precision.kappa, e.precision.tau});
    border.robot_of_edge.push_back(other.robot);
    own.insert(at);
  }
  border.own.assign(own.begin(), own.end());
  return border;
}

}  // namespace km

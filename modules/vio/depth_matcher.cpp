#include "modules/vio/depth_matcher.hpp"

#include "modules/core/depth_lookup.hpp"

namespace km {

DepthMatcher::DepthMatcher(const StereoRig& rig, const TrackerConfig& config)
    : T_right_left_(rig.T_left_right().inverse()),
      max_inverse_depth_(1.0 / config.min_depth_m),
      edge_(depth_edge(rig)) {}

std::vector<std::optional<StereoMatch>> DepthMatcher::match(const DepthImage* depth,
                                                            std::span<const StereoQuery> queries) {
  statistics_ = {};
  std::vector<std::optional<StereoMatch>> result(queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const StereoQuery& query = queries[i];
    const auto inverse_depth = depth != nullptr
                                   ? inverse_depth_at(*depth, query.left_px.cast<double>(), edge_)
                                   : std::nullopt;
    if (!inverse_depth || *inverse_depth > max_inverse_depth_) {
      ++statistics_.no_start;
      continue;
    }
    const Eigen::Vector3d right = T_right_left_.linear() * query.left.homogeneous() +
                                  *inverse_depth * T_right_left_.translation();
    result[i] = StereoMatch{right.hnormalized(), *inverse_depth};
    ++statistics_.matched;
  }
  return result;
}

}  // namespace km

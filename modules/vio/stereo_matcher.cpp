#include "modules/vio/stereo_matcher.hpp"

#include <algorithm>
#include <cmath>

#include "modules/core/camera/depth_lookup.hpp"
#include "modules/vio/patches.hpp"

namespace km {
namespace {

constexpr float kMinStereoCorrelation = 0.8F;  // Least correlation of a match at full resolution.
// Least correlation of a search at half resolution and whole pixels.
constexpr float kMinSearchCorrelation = 0.7F;
// Least difference of correlation between the best and the second best place. A fence or a net has
// many similar places.
constexpr float kMinDistinction = 0.05F;
constexpr int kPeakWidth = 2;             // Width in steps of one correlation peak.
constexpr double kMinDisparityPx = -1.0;  // Least disparity; below 0 due to noise at infinity.

}  // namespace

StereoMatcher::StereoMatcher(const StereoRig& rig, const TrackerConfig& config)
    : rig_(rig), config_(config), T_right_left_(rig.T_left_right().inverse()) {}

Eigen::Vector3d StereoMatcher::right_ray(const Eigen::Vector2d& left, double inverse_depth) const {
  return T_right_left_.linear() * left.homogeneous() + inverse_depth * T_right_left_.translation();
}

Eigen::Vector2d StereoMatcher::right_bearing(const Eigen::Vector2d& left,
                                             double inverse_depth) const {
  return right_ray(left, inverse_depth).hnormalized();
}

std::optional<StereoMatcher::Start> StereoMatcher::search(const ImagePyramid& left,
                                                          const ImagePyramid& right,
                                                          const StereoQuery& query) const {
  const cv::Mat& image = right.level(1);
  const Eigen::Vector2i centre = (0.5F * query.left_px).array().round().cast<int>();
  if (!PatchTemplate::covered_by(left.level(1), centre.x(), centre.y())) return std::nullopt;
  const PatchTemplate patch(left.level(1), centre.x(), centre.y());
  if (!patch.has_contrast()) return std::nullopt;

  // Equal steps of inverse depth are equal steps of disparity, here about one pixel of level 1.
  const double nearest = 1.0 / config_.min_depth_m;
  const int steps = std::max(
      2, static_cast<int>(0.5 * rig_.cameras[1].fx * T_right_left_.translation().norm() * nearest));
  std::vector<float> scores(static_cast<std::size_t>(steps) + 1, -1.0F);
  std::vector<Eigen::Vector2i> places(scores.size());
  std::size_t best = 0;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const double inverse_depth = nearest * static_cast<double>(i) / steps;
    const auto full = rig_.cameras[1].project_ray(right_ray(query.left, inverse_depth));
    if (!full) continue;
    const Eigen::Vector2d px = 0.5 * *full;
    const bool inside =
        px.x() >= 0.0 && px.y() >= 0.0 && px.x() < image.cols && px.y() < image.rows;
    if (!inside) continue;
    places[i] = px.array().round().cast<int>();
    if (!PatchTemplate::covered_by(image, places[i].x(), places[i].y())) continue;
    scores[i] = patch.correlation(image, places[i].x(), places[i].y());
    if (scores[i] > scores[best]) best = i;
  }
  if (scores[best] < kMinSearchCorrelation) return std::nullopt;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const bool same_peak = i + kPeakWidth >= best && i <= best + kPeakWidth;
    if (!same_peak && scores[i] > scores[best] - kMinDistinction) return std::nullopt;
  }
  const Eigen::Vector2f rounding = query.left_px - 2.0F * centre.cast<float>();
  return Start{2.0F * places[best].cast<float>() + rounding,
               nearest * static_cast<double>(best) / steps};
}

std::optional<StereoMatcher::Start> StereoMatcher::start_of(const ImagePyramid& left,
                                                            const ImagePyramid& right,
                                                            const StereoQuery& query) const {
  if (!query.inverse_depth) return search(left, right, query);
  const auto expected = rig_.cameras[1].project_ray(right_ray(query.left, *query.inverse_depth));
  if (!expected) return std::nullopt;
  return Start{expected->cast<float>(), *query.inverse_depth};
}

std::optional<StereoMatch> StereoMatcher::triangulate(const StereoQuery& query,
                                                      const Eigen::Vector2f& right_px) const {
  const std::optional<Eigen::Vector2d> right = rig_.cameras[1].unproject(right_px.cast<double>());
  if (!right) return std::nullopt;
  // The epipolar line starts at the bearing at infinity and has direction `along`. `offset` is the
  // position relative to that start [px].
  const double f = rig_.cameras[1].fx;
  const Eigen::Vector2d infinity = right_bearing(query.left, 0.0);
  const Eigen::Vector2d along =
      (right_bearing(query.left, 1.0 / config_.min_depth_m) - infinity).normalized();
  const Eigen::Vector2d offset = f * (*right - infinity);
  const double across_px = along.x() * offset.y() - along.y() * offset.x();
  if (!(std::abs(across_px) <= config_.max_epipolar_px)) return std::nullopt;
  if (!(along.dot(offset) >= kMinDisparityPx)) return std::nullopt;

  // The inverse depth rho for which c + rho t has the right bearing, measured along the line.
  const Eigen::Vector3d c = T_right_left_.linear() * query.left.homogeneous();
  const Eigen::Vector3d& t = T_right_left_.translation();
  const double rho = along.dot(*right * c.z() - c.head<2>()) /
                     along.dot(Eigen::Vector2d(t.head<2>() - *right * t.z()));
  return StereoMatch{*right, std::max(rho, 0.0)};
}

std::optional<StereoMatch> StereoMatcher::match_one(const ImagePyramid& left,
                                                    const ImagePyramid& right,
                                                    const StereoQuery& query) const {
  const std::optional<Start> start = start_of(left, right, query);
  if (!start) return std::nullopt;
  const std::optional<AlignmentPatch> patch = AlignmentPatch::cut(left.level(0), query.left_px);
  const Eigen::Matrix2f A =
      local_warp(rig_.cameras[0], rig_.cameras[1], query.left, start->inverse_depth, T_right_left_);
  const std::optional<PatchAlignment> found =
      patch ? patch->align(right.level(0), start->right_px, A) : std::nullopt;
  if (!found || !(found->correlation >= kMinStereoCorrelation)) return std::nullopt;
  return triangulate(query, found->px);
}

std::vector<std::optional<StereoMatch>> StereoMatcher::match(
    const ImagePyramid& left, const ImagePyramid& right,
    std::span<const StereoQuery> queries) const {
  std::vector<std::optional<StereoMatch>> result;
  result.reserve(queries.size());
  for (const StereoQuery& query : queries) result.push_back(match_one(left, right, query));
  return result;
}

DepthMatcher::DepthMatcher(const StereoRig& rig, const TrackerConfig& config)
    : T_right_left_(rig.T_left_right().inverse()),
      max_inverse_depth_(1.0 / config.min_depth_m),
      edge_(depth_edge_threshold(rig)) {}

std::vector<std::optional<StereoMatch>> DepthMatcher::match(
    const DepthImage* depth, std::span<const StereoQuery> queries) const {
  std::vector<std::optional<StereoMatch>> result(queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const StereoQuery& query = queries[i];
    const auto inverse_depth = depth != nullptr
                                   ? inverse_depth_at(*depth, query.left_px.cast<double>(), edge_)
                                   : std::nullopt;
    if (!inverse_depth || !(*inverse_depth <= max_inverse_depth_)) continue;
    const Eigen::Vector3d right = T_right_left_.linear() * query.left.homogeneous() +
                                  *inverse_depth * T_right_left_.translation();
    result[i] = StereoMatch{right.hnormalized(), *inverse_depth};
  }
  return result;
}

}  // namespace km

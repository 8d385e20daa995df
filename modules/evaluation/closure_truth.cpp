#include "modules/evaluation/closure_truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <stdexcept>
#include <utility>

namespace km {
namespace {

constexpr int kGridColumns = 8;
constexpr int kGridRows = 6;
constexpr double kMaxDepthRatio = 2.0;
constexpr double kDegrees = 180.0 / std::numbers::pi;

using Pair = std::pair<KeyframeId, KeyframeId>;  // the smaller first

Pair pair_of(const KeyframeId& a, const KeyframeId& b) {
  return a < b ? Pair{a, b} : Pair{b, a};
}

double share(std::size_t part, std::size_t whole) {
  if (whole == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(part) / static_cast<double>(whole);
}

void check(const ClosureTruthOptions& options) {
  if (!(options.max_translation_m > 0.0) || !(options.max_rotation_deg > 0.0))
    throw std::invalid_argument("score_closures: a limit of the error is not positive");
  if (!(options.min_overlap > 0.0) || !(options.min_overlap <= 1.0))
    throw std::invalid_argument("score_closures: min_overlap is not within (0, 1]");
  if (!(options.default_depth_m > 0.0))
    throw std::invalid_argument("score_closures: default_depth_m is not positive");
}

// The grid of an image as bearings on z = 1; those that the distortion leaves without one are out.
std::vector<Eigen::Vector3d> grid_of(const PinholeCamera& camera) {
  std::vector<Eigen::Vector3d> bearings;
  for (int row = 0; row < kGridRows; ++row)
    for (int column = 0; column < kGridColumns; ++column) {
      const Eigen::Vector2d pixel((column + 0.5) * camera.width / kGridColumns,
                                  (row + 0.5) * camera.height / kGridRows);
      if (const auto bearing = camera.unproject(pixel)) bearings.push_back(bearing->homogeneous());
    }
  return bearings;
}

double overlap(const PinholeCamera& camera, const std::vector<Eigen::Vector3d>& grid,
               const SE3& T_a_b, double depth_m) {
  const SE3 T_b_a = T_a_b.inverse();
  std::size_t seen = 0;
  for (const Eigen::Vector3d& bearing : grid) {
    const Eigen::Vector3d p_b = T_b_a * (depth_m * bearing);
    if (p_b.z() * kMaxDepthRatio < depth_m || p_b.z() > kMaxDepthRatio * depth_m) continue;
    const Eigen::Vector2d px = camera.project(p_b.hnormalized());
    if (px.x() >= 0.0 && px.y() >= 0.0 && px.x() < camera.width && px.y() < camera.height) ++seen;
  }
  return grid.empty() ? 0.0 : share(seen, grid.size());
}

// Keyframes with their true poses, and which of them see the same place.
class Places {
 public:
  Places(std::span<const TrueKeyframe> keyframes, const PinholeCamera& camera,
         const ClosureTruthOptions& options)
      : camera_(camera), options_(options), grid_(grid_of(camera)) {
    for (const TrueKeyframe& keyframe : keyframes)
      if (!keyframes_.emplace(keyframe.id, &keyframe).second)
        throw std::invalid_argument("score_closures: keyframe " + to_string(keyframe.id) +
                                    " is given twice");
  }

  const TrueKeyframe* find(const KeyframeId& id) const {
    const auto found = keyframes_.find(id);
    return found != keyframes_.end() ? found->second : nullptr;
  }

  bool see_the_same(const TrueKeyframe& a, const TrueKeyframe& b) const {
    const SE3 T_a_b = camera_.T_body_cam.inverse() * a.T_world_body.inverse() * b.T_world_body *
                      camera_.T_body_cam;
    return overlap(camera_, grid_, T_a_b, depth_of(a)) >= options_.min_overlap &&
           overlap(camera_, grid_, T_a_b.inverse(), depth_of(b)) >= options_.min_overlap;
  }

  // Pairs of keyframes of two robots that do.
  std::set<Pair> true_pairs() const {
    std::set<Pair> pairs;
    for (auto a = keyframes_.begin(); a != keyframes_.end(); ++a)
      for (auto b = std::next(a); b != keyframes_.end(); ++b)
        if (a->first.robot != b->first.robot && see_the_same(*a->second, *b->second))
          pairs.insert({a->first, b->first});
    return pairs;
  }

 private:
  double depth_of(const TrueKeyframe& keyframe) const {
    return keyframe.scene_depth_m > 0.0 ? keyframe.scene_depth_m : options_.default_depth_m;
  }

  const PinholeCamera& camera_;
  const ClosureTruthOptions& options_;
  std::vector<Eigen::Vector3d> grid_;
  std::map<KeyframeId, const TrueKeyframe*> keyframes_;
};

// What is summed up into a StageScore.
class StageCounter {
 public:
  explicit StageCounter(const std::set<Pair>& true_pairs) : true_pairs_(true_pairs) {}

  void count(const ClosureId& id, bool is_true) {
    ++score_.judged;
    if (!is_true) return;
    ++score_.correct;
    const Pair pair = pair_of(id.from, id.to);
    if (true_pairs_.contains(pair)) found_.insert(pair);
  }

  void add_error(double translation_m, double rotation_deg) {
    translations_m_.push_back(translation_m);
    rotations_deg_.push_back(rotation_deg);
  }

  StageScore score() && {
    std::set<KeyframeId> frames;
    for (const auto& [a, b] : found_) frames.insert({a, b});
    score_.pairs_found = found_.size();
    score_.frames_found = frames.size();
    score_.translation_error_m = statistics_of(std::move(translations_m_));
    score_.rotation_error_deg = statistics_of(std::move(rotations_deg_));
    return score_;
  }

 private:
  const std::set<Pair>& true_pairs_;
  StageScore score_;
  std::set<Pair> found_;
  std::vector<double> translations_m_, rotations_deg_;
};

}  // namespace

double view_overlap(const PinholeCamera& camera, const SE3& T_a_b, double depth_m) {
  return overlap(camera, grid_of(camera), T_a_b, depth_m);
}

double StageScore::precision() const {
  return share(correct, judged);
}

double ClosureScores::pair_recall(const StageScore& stage) const {
  return share(stage.pairs_found, true_pairs);
}

double ClosureScores::frame_recall(const StageScore& stage) const {
  return share(stage.frames_found, true_frames);
}

ClosureScores score_closures(std::span<const TrueKeyframe> keyframes,
                             std::span<const ClosureRecord> closures, const PinholeCamera& camera,
                             const ClosureTruthOptions& options) {
  check(options);
  const Places places(keyframes, camera, options);
  const std::set<Pair> true_pairs = places.true_pairs();
  StageCounter candidates(true_pairs), verified(true_pairs), inliers(true_pairs);
  ClosureScores scores;
  for (const ClosureRecord& closure : closures) {
    const bool measured = closure.stage >= ClosureStage::kVerified;
    if (measured && !closure.T_from_to)
      throw std::invalid_argument("score_closures: closure " + to_string(closure.id.from) + " - " +
                                  to_string(closure.id.to) + " is verified, but has no pose");
    const TrueKeyframe* const from = places.find(closure.id.from);
    const TrueKeyframe* const to = places.find(closure.id.to);
    if (from == nullptr || to == nullptr) {
      ++scores.unjudged;
      continue;
    }
    candidates.count(closure.id, places.see_the_same(*from, *to));
    if (!measured) continue;
    const SE3 T_from_to = from->T_world_body.inverse() * to->T_world_body;
    const SE3 error = T_from_to.inverse() * *closure.T_from_to;
    const double error_m = error.translation().norm();
    const double error_deg = kDegrees * angle_of(error.linear());
    const bool is_true =
        error_m <= options.max_translation_m && error_deg <= options.max_rotation_deg;
    for (StageCounter* const stage : {&verified, &inliers}) {
      if (stage == &inliers && closure.stage != ClosureStage::kInlier) continue;
      stage->count(closure.id, is_true);
      stage->add_error(error_m, error_deg);
    }
  }
  std::set<KeyframeId> frames;
  for (const auto& [a, b] : true_pairs) frames.insert({a, b});
  scores.true_pairs = true_pairs.size();
  scores.true_frames = frames.size();
  scores.candidates = std::move(candidates).score();
  scores.verified = std::move(verified).score();
  scores.inliers = std::move(inliers).score();
  return scores;
}

}  // namespace km

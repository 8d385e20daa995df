#include "modules/evaluation/closure_truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "modules/core/config.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/input_row.hpp"
#include "modules/evaluation/report.hpp"

namespace km {
namespace {

constexpr int kGridColumns = 8;
constexpr int kGridRows = 6;
constexpr double kMaxDepthRatio = 2.0;
constexpr double k999Of6 = 22.4577;  // quantile of chi-squared, 6 degrees of freedom

// Number of keyframes in the pairs.
std::size_t frames_in(const std::set<ClosureId>& pairs) {
  std::set<KeyframeId> frames;
  for (const auto& [from, to] : pairs) frames.insert({from, to});
  return frames.size();
}

double share(std::size_t part, std::size_t whole) {
  if (whole == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(part) / static_cast<double>(whole);
}

// The grid of an image as bearings on z = 1, without pixels for which the lens has no bearing.
std::vector<Eigen::Vector3d> grid_of(const Camera& camera) {
  std::vector<Eigen::Vector3d> bearings;
  for (int row = 0; row < kGridRows; ++row)
    for (int column = 0; column < kGridColumns; ++column) {
      const Eigen::Vector2d pixel((column + 0.5) * camera.width / kGridColumns,
                                  (row + 0.5) * camera.height / kGridRows);
      if (const auto bearing = camera.unproject(pixel)) bearings.push_back(bearing->homogeneous());
    }
  return bearings;
}

double overlap(const Camera& camera, const std::vector<Eigen::Vector3d>& grid, const SE3& T_a_b,
               double depth_m) {
  const SE3 T_b_a = T_a_b.inverse();
  std::size_t seen = 0;
  for (const Eigen::Vector3d& bearing : grid) {
    const Eigen::Vector3d p_b = T_b_a * (depth_m * bearing);
    if (p_b.z() * kMaxDepthRatio < depth_m || p_b.z() > kMaxDepthRatio * depth_m) continue;
    const auto px = camera.project_ray(p_b);
    if (px && px->x() >= 0.0 && px->y() >= 0.0 && px->x() < camera.width && px->y() < camera.height)
      ++seen;
  }
  return grid.empty() ? 0.0 : share(seen, grid.size());
}

// Keyframes with their true poses, and the pairs of them that see the same place.
class Places {
 public:
  Places(std::span<const TrueKeyframe> keyframes, const Camera& camera,
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

  // Bin of ClosureScores::by_angle. Precondition: both keyframes of the pair are known.
  std::size_t angle_bin(const ClosureId& pair) const {
    const auto axis_of = [&](const KeyframeId& id) -> Eigen::Vector3d {
      return find(id)->T_world_body.linear() * camera_.T_body_cam.linear().col(2);
    };
    const double cosine = axis_of(pair.from).dot(axis_of(pair.to));
    const double angle_deg = kDegrees * std::acos(std::clamp(cosine, -1.0, 1.0));
    const auto bin = static_cast<std::size_t>(angle_deg / ClosureScores::kAngleBin_deg);
    return std::min(bin, ClosureScores::kAngleBins - 1);
  }

  // Pairs of keyframes of two robots that see the same place.
  std::set<ClosureId> true_pairs() const {
    std::set<ClosureId> pairs;
    for (auto a = keyframes_.begin(); a != keyframes_.end(); ++a)
      for (auto b = std::next(a); b != keyframes_.end(); ++b)
        if (a->first.robot != b->first.robot && see_the_same(*a->second, *b->second))
          pairs.insert(closure_id(a->first, b->first));
    return pairs;
  }

 private:
  double depth_of(const TrueKeyframe& keyframe) const {
    return keyframe.scene_depth_m > 0.0 ? keyframe.scene_depth_m : options_.default_depth_m;
  }

  const Camera& camera_;
  const ClosureTruthOptions& options_;
  std::vector<Eigen::Vector3d> grid_;
  std::map<KeyframeId, const TrueKeyframe*> keyframes_;
};

// Counts for a StageScore.
class StageCounter {
 public:
  explicit StageCounter(const std::set<ClosureId>& true_pairs) : true_pairs_(true_pairs) {}

  void count(const ClosureId& id, bool is_true) {
    ++score_.judged;
    if (!is_true) return;
    ++score_.correct;
    const ClosureId pair = closure_id(id.from, id.to);
    if (true_pairs_.contains(pair)) found_.insert(pair);
  }

  void add_error(double translation_m, double rotation_deg, bool beyond_limits) {
    score_.beyond_limits += beyond_limits;
    translations_m_.push_back(translation_m);
    rotations_deg_.push_back(rotation_deg);
  }

  const std::set<ClosureId>& found() const { return found_; }

  StageScore score() && {
    score_.pairs_found = found_.size();
    score_.frames_found = frames_in(found_);
    score_.translation_error_m = statistics_of(std::move(translations_m_));
    score_.rotation_error_deg = statistics_of(std::move(rotations_deg_));
    return score_;
  }

 private:
  const std::set<ClosureId>& true_pairs_;
  StageScore score_;
  std::set<ClosureId> found_;
  std::vector<double> translations_m_, rotations_deg_;
};

}  // namespace

double view_overlap(const Camera& camera, const SE3& T_a_b, double depth_m) {
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
                             std::span<const ClosureRecord> closures, const Camera& camera,
                             const ClosureTruthOptions& limits) {
  const ClosureTruthOptions options = checked(limits);
  const Places places(keyframes, camera, options);
  const std::set<ClosureId> true_pairs = places.true_pairs();
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
    const SE3 error = closure.T_from_to->inverse() * T_from_to;
    const double error_m = error.translation().norm();
    const double error_deg = kDegrees * angle_of(error.linear());
    const bool beyond_limits =
        error_m > options.max_translation_m || error_deg > options.max_rotation_deg;
    const bool is_true =
        !beyond_limits || se3_log(error).cwiseQuotient(closure.sigma).squaredNorm() <= k999Of6;
    for (StageCounter* const stage : {&verified, &inliers}) {
      if (stage == &inliers && closure.stage != ClosureStage::kInlier) continue;
      stage->count(closure.id, is_true);
      stage->add_error(error_m, error_deg, beyond_limits);
    }
  }
  scores.true_pairs = true_pairs.size();
  scores.true_frames = frames_in(true_pairs);
  for (const ClosureId& pair : true_pairs) {
    AngleScore& bin = scores.by_angle.at(places.angle_bin(pair));
    ++bin.true_pairs;
    bin.pairs_found += inliers.found().contains(pair);
  }
  scores.candidates = std::move(candidates).score();
  scores.verified = std::move(verified).score();
  scores.inliers = std::move(inliers).score();
  return scores;
}

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPoseColumn = 8, kSigmaColumn = kPoseColumn + 7;
constexpr std::size_t kReasonColumn = kSigmaColumn + 6;
// Largest stamp for which differences of stamps cannot overflow.
constexpr Stamp kMaxKeyframeStamp = std::numeric_limits<Stamp>::max() / 2;

constexpr std::array<std::pair<const char*, ClosureStage>, 5> kStages = {
    {{"candidate", ClosureStage::kCandidate},
     {"requested", ClosureStage::kRequested},
     {"received", ClosureStage::kReceived},
     {"verified", ClosureStage::kVerified},
     {"inlier", ClosureStage::kInlier}}};

KeyframeId keyframe_of(const InputRow& row, std::size_t i) {
  return {
      static_cast<RobotId>(row.integer(i, std::numeric_limits<RobotId>::max())),
      static_cast<std::uint32_t>(row.integer(i + 1, std::numeric_limits<std::uint32_t>::max()))};
}

double depth_of(const InputRow& row, std::size_t i) {
  const double depth_m = row.number(i);
  if (std::abs(depth_m) > kMaxInput_m)
    row.fail("a depth of " + shortest_text(depth_m) + " m is beyond " + shortest_text(kMaxInput_m));
  return depth_m;
}

// Text of field `i` and all fields after it, joined by commas, without quotes. The last field may
// contain commas.
std::string rest_of(const InputRow& row, std::size_t i) {
  std::string all;
  for (; i < row.size(); ++i) all.append(all.empty() ? "" : ", ").append(row.text(i));
  std::erase(all, '"');
  return all;
}

// Calls use(row) for every row below the header.
void for_each_row(std::string_view text, const std::string& file, std::size_t expected,
                  const auto& use) {
  bool header = true;
  for (const TextRow& fields : split_rows(text)) {
    if (std::exchange(header, false)) continue;
    const InputRow row(file, fields);
    if (row.size() < expected)
      row.fail(std::to_string(row.size()) + " fields, expected " + std::to_string(expected));
    use(row);
  }
}

ClosureStage stage_of(const InputRow& row, std::size_t i) {
  for (const auto& [name, stage] : kStages)
    if (row.text(i) == name) return stage;
  row.fail(std::string(row.text(i)) + " is no stage of a closure");
}

}  // namespace

std::vector<KeyframeRecord> read_keyframes(const fs::path& file) {
  std::vector<KeyframeRecord> keyframes;
  for_each_row(read_input_file(file), file.string(), 4, [&](const InputRow& row) {
    keyframes.push_back({keyframe_of(row, 0), row.integer(2, kMaxKeyframeStamp), depth_of(row, 3)});
  });
  return keyframes;
}

std::vector<ClosureRecord> read_closures(const fs::path& file) {
  std::vector<ClosureRecord> closures;
  for_each_row(read_input_file(file), file.string(), kReasonColumn, [&](const InputRow& row) {
    ClosureRecord closure;
    closure.id = {keyframe_of(row, 0), keyframe_of(row, 2)};
    closure.stage = stage_of(row, 5);
    closure.matches = static_cast<int>(row.integer(6, std::numeric_limits<int>::max()));
    closure.inliers = static_cast<int>(row.integer(7, std::numeric_limits<int>::max()));
    closure.reason = rest_of(row, kReasonColumn);
    if (!row.text(kPoseColumn).empty()) {
      closure.T_from_to = row.pose(kPoseColumn, false);
      for (std::size_t i = 0; i < 6; ++i)
        closure.sigma[static_cast<Eigen::Index>(i)] = row.number(kSigmaColumn + i);
    } else if (closure.stage >= ClosureStage::kVerified) {
      row.fail("a verified closure without a pose");
    }
    closures.push_back(std::move(closure));
  });
  return closures;
}

std::vector<TrueKeyframe> place_keyframes(std::span<const KeyframeRecord> keyframes,
                                          std::span<const StampedPose> truth) {
  std::vector<TrueKeyframe> placed;
  for (const KeyframeRecord& keyframe : keyframes)
    if (const auto T_world_body = pose_at(truth, keyframe.stamp))
      placed.push_back({keyframe.id, *T_world_body, keyframe.scene_depth_m});
  return placed;
}

namespace {

Json to_json(const ClosureScores& scores, const StageScore& stage) {
  const bool measured = stage.translation_error_m.count > 0;
  return {{"judged", stage.judged},
          {"correct", stage.correct},
          {"beyond_limits", measured ? Json(stage.beyond_limits) : Json()},
          {"precision", stage.precision()},
          {"pairs_found", stage.pairs_found},
          {"pair_recall", scores.pair_recall(stage)},
          {"frames_found", stage.frames_found},
          {"frame_recall", scores.frame_recall(stage)},
          {"translation_error_m", stage.translation_error_m},
          {"rotation_error_deg", stage.rotation_error_deg}};
}

}  // namespace

std::string to_table(const ClosureScores& scores) {
  constexpr ReportColumn kColumns[] = {{"closures", "/stage"},
                                       {"judged", "/judged"},
                                       {"true", "/correct"},
                                       {"beyond limits", "/beyond_limits"},
                                       percent_column("precision", "/precision"),
                                       percent_column("recall, pairs", "/pair_recall"),
                                       percent_column("recall, keyframes", "/frame_recall"),
                                       {"median [m]", "/translation_error_m/median", 3},
                                       {"max [m]", "/translation_error_m/max", 3},
                                       {"median [deg]", "/rotation_error_deg/median", 2},
                                       {"max [deg]", "/rotation_error_deg/max", 2}};
  const Json json = scores;
  Json rows = Json::array();
  for (const char* stage : {"candidates", "verified", "inliers"}) {
    rows.push_back(json[stage]);
    rows.back()["stage"] = stage;
  }
  std::string text = report_table(rows, kColumns);
  text += std::to_string(scores.true_pairs) +
          " pairs of keyframes of two robots see the same place, in them " +
          std::to_string(scores.true_frames) + " keyframes";
  if (scores.unjudged > 0)
    text += "; " + std::to_string(scores.unjudged) + " closures are without a true pose";
  return text + ".\n";
}

void to_json(Json& json, const ClosureScores& scores) {
  Json by_angle = Json::array();
  for (const AngleScore& bin : scores.by_angle) {
    const double from_deg = ClosureScores::kAngleBin_deg * static_cast<double>(by_angle.size());
    by_angle.push_back({{"from_deg", from_deg},
                        {"to_deg", from_deg + ClosureScores::kAngleBin_deg},
                        {"true_pairs", bin.true_pairs},
                        {"pairs_found", bin.pairs_found}});
  }
  json = {{"true_pairs", scores.true_pairs},
          {"true_frames", scores.true_frames},
          {"unjudged", scores.unjudged},
          {"candidates", to_json(scores, scores.candidates)},
          {"verified", to_json(scores, scores.verified)},
          {"inliers", to_json(scores, scores.inliers)},
          {"by_angle", std::move(by_angle)}};
}

}  // namespace km

#include "modules/evaluation/mesh/mesh_error.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <stdexcept>
#include <utility>

#include "modules/core/config.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/core/quantile.hpp"

namespace km {
namespace {

double share_within(const std::vector<float>& values, float limit) {
  const auto count =
      std::count_if(values.begin(), values.end(), [&](float value) { return value <= limit; });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

// O(n).
DistanceSummary summary_of(std::vector<float> distances_m) {
  DistanceSummary summary{.count = distances_m.size()};
  if (distances_m.empty()) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    return {0, none, none, none, none, none};
  }
  double sum = 0.0;
  for (const float distance : distances_m) sum += static_cast<double>(distance);
  summary.mean_m = sum / static_cast<double>(distances_m.size());
  summary.within_5cm = share_within(distances_m, 0.05F);
  summary.within_10cm = share_within(distances_m, 0.10F);
  summary.median_m = quantile(distances_m, 0.5);
  summary.p95_m = quantile(std::move(distances_m), 0.95);
  return summary;
}

double ratio(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                   : std::numeric_limits<double>::quiet_NaN();
}

void check_comparable(const LabelledMesh& mesh, const std::string& name) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(name + ": " + why);
  };
  const std::string vertices = std::to_string(mesh.vertices.size());
  if (mesh.faces.empty()) refuse("no faces, so no surface to compare");
  for (const auto& face : mesh.faces)
    for (const std::uint32_t corner : face)
      if (corner >= mesh.vertices.size())
        refuse("a face names vertex " + std::to_string(corner) + " of " + vertices);
  if (!mesh.labels.empty() && mesh.labels.size() != mesh.vertices.size())
    refuse(std::to_string(mesh.labels.size()) + " labels for " + vertices + " vertices");
  const double area = surface_area(mesh);
  if (!std::isfinite(area)) refuse("coordinates that are not finite");
  if (!(area > 0.0)) refuse("its faces have no area");
}

constexpr std::size_t kChunk = 1U << 18;  // points between two reports of progress

// A mesh with points on it; both outlive this.
struct SampledMesh {
  const LabelledMesh& mesh;
  const SurfaceSamples& samples;

  [[nodiscard]] LabelId label(std::size_t sample) const {
    return mesh.face_label(samples.faces[sample]);
  }
};

// The nearest surface of another mesh for a point of a mesh.
struct PointMatch {
  // Distance to the nearest sample; infinite if none is within reach.
  float point_m = std::numeric_limits<float>::infinity();
  float surface_m = std::numeric_limits<float>::infinity();  // See NearestSample::surface_m.
  LabelId label = 0;  // Label of the nearest face (NearestSample::face).

  // Whether that face is in front of the point: the mesh does not end there, and the two faces do
  // not face opposite ways. Otherwise the point may be on surface that the other mesh never saw,
  // such as the ground below a car or the back of a wall.
  bool in_front = false;

  [[nodiscard]] bool is_near() const { return std::isfinite(point_m); }
};
using PointMatches = std::vector<PointMatch>;

// Takes the values of `others` where their surface is nearer. A point in front of either mesh is in
// front. Precondition: both matches have the same points.
void keep_nearer(PointMatches& matches, const PointMatches& others) {
  for (std::size_t i = 0; i < matches.size(); ++i) {
    PointMatch& match = matches[i];
    const PointMatch& other = others[i];
    match.point_m = std::min(match.point_m, other.point_m);
    match.in_front = match.in_front || other.in_front;
    if (other.surface_m >= match.surface_m) continue;
    match.surface_m = other.surface_m;
    match.label = other.label;
  }
}

// Whether a true point counts for both of two states of a mesh: either state can show it.
struct SharedPoint {
  bool near = false;      // within reach
  bool in_front = false;  // see PointMatch
  bool labelled = false;  // within the distance at which labels are judged
};

// Uses OpenCV's threads; the result does not depend on their number. Calls `progress` with `stage`.
PointMatches match_points(const SampledMesh& from, const SampledMesh& to,
                          const NearestSurface& nearest_to, double reach_m, std::string_view stage,
                          const MeshProgress& progress) {
  const std::size_t count = from.samples.points.size();
  PointMatches matches(count);
  const auto match = [&](std::size_t i) {
    const auto near = nearest_to.find(from.samples.points[i], reach_m);
    if (!near) return;
    const Eigen::Vector3f normal = from.mesh.face_normal(from.samples.faces[i]);
    matches[i] = {near->distance_m, near->surface_m, to.mesh.face_label(near->face),
                  !near->past_boundary && normal.dot(to.mesh.face_normal(near->face)) > 0.0F};
  };
  for (std::size_t start = 0; start < count; start += kChunk) {
    if (progress) progress(stage, static_cast<double>(start) / static_cast<double>(count));
    const auto size = static_cast<int>(std::min(kChunk, count - start));
    cv::parallel_for_(cv::Range(0, size), [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) match(start + static_cast<std::size_t>(i));
    });
  }
  return matches;
}

constexpr float kMostLength_m = 1e4F;  // longest edge of a face

// The longest edge of a face.
float length_of(const LabelledMesh& mesh, const LabelledMesh::Face& face) {
  const Eigen::Vector3f &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]],
                        &c = mesh.vertices[face[2]];
  return std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
}

constexpr double kRegistrationPerM2 = 250.0;  // planes need no more
constexpr double kLargeMove_m = 0.5;
constexpr double kLargeTurn_deg = 3.0;

class Evaluation {
 public:
  // `inputs`: one or more states, each with `robots` meshes.
  Evaluation(const LabelledMesh& truth, std::vector<MeshInput> inputs, std::size_t robots,
             const MeshErrorOptions& options, const MeshProgress& progress)
      : truth_(truth),
        inputs_(std::move(inputs)),
        robots_(robots),
        options_(options),
        progress_(progress) {
    check_comparable(truth, "truth");
    if (inputs_.empty()) throw std::invalid_argument("no estimated mesh");
    for (const MeshInput& input : inputs_) check_comparable(input.mesh, input.name);
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& vertex : truth.vertices) box.extend(vertex);
    longest_m_ = 10.0F * box.diagonal().norm();
    for (const LabelledMesh::Face& face : truth.faces)
      if (const float length_m = length_of(truth, face); length_m > kMostLength_m)
        throw std::invalid_argument("truth: a face of " + shortest_text(std::round(length_m)) +
                                    " m: has it a vertex far away?");
  }

  // A report for each state.
  std::vector<MeshReport> run() {
    if (const std::size_t long_faces = place(options_.T_truth_estimate); long_faces > 0)
      report_.notes.push_back(std::to_string(long_faces) +
                              " faces are longer than ten times the truth, " +
                              fixed(static_cast<double>(longest_m_), 1) + " m: left out");
    choose_density();
    report_.registration.T_truth_estimate = options_.T_truth_estimate;
    if (options_.icp) register_estimates();
    sample();
    report_.samples_per_m2 = per_m2_;
    note_labels();
    note_density();
    reports_.assign(inputs_.size() / robots_, report_);
    describe();
    compare_truth();
    compare_estimates();
    if (robots_ == 1)
      for (MeshReport& report : reports_) report.merged = report.robots.front();
    return std::move(reports_);
  }

 private:
  void begin(std::string_view stage) const {
    if (progress_) progress_(stage, 0.0);
  }

  // Leaves out faces of more than ten times the length of the truth, because one vertex far away
  // would take all samples. Returns their number.
  std::size_t place(const SE3& T_truth_estimate) {
    moved_.clear();
    std::size_t long_faces = 0;
    for (const MeshInput& input : inputs_) {
      LabelledMesh& mesh = moved_.emplace_back(input.mesh);
      mesh.transform(T_truth_estimate);
      long_faces += std::erase_if(
          mesh.faces, [&](const auto& face) { return length_of(mesh, face) > longest_m_; });
    }
    return long_faces;
  }

  void choose_density() {
    double area = 0.0;
    for (const LabelledMesh& mesh : moved_) area += surface_area(mesh);
    per_m2_ = std::min(options_.samples_per_m2, static_cast<double>(options_.max_samples) / area);
  }

  [[nodiscard]] std::vector<SurfaceSamples> sampled_estimates(double per_m2) const {
    std::vector<SurfaceSamples> samples;
    // The seed differs from that of the truth, so that a mesh compared with itself has other
    // points.
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      samples.push_back(sample_surface(moved_[i], per_m2, options_.seed + 1));
      if (samples.back().points.empty())
        throw std::invalid_argument(inputs_[i].name + ": too small for a single sample at " +
                                    fixed(per_m2, 0) + " per square metre");
    }
    return samples;
  }

  [[nodiscard]] SurfaceSamples sampled_truth(double per_m2, double reach_m,
                                             const std::vector<SurfaceSamples>& estimates) const {
    NearbyCells nearby(reach_m);
    for (const SurfaceSamples& samples : estimates) nearby.add(samples.points);
    SurfaceSamples truth =
        sample_surface(truth_, per_m2, options_.seed, &nearby, options_.max_samples);
    if (truth.near == 0)
      throw std::invalid_argument("no part of the truth is within " + fixed(reach_m, 2) +
                                  " m of the estimate: are both in one frame?");
    return truth;
  }

  void register_estimates() {
    begin("registering");
    const double per_m2 = std::min(per_m2_, kRegistrationPerM2);
    const auto estimates = sampled_estimates(per_m2);
    const SurfaceSamples truth = sampled_truth(per_m2, kRegistrationReach_m, estimates);
    const NearestSurface nearest(truth_, truth);
    OrientedPoints all;
    for (std::size_t i = 0; i < estimates.size(); ++i) all.add(moved_[i], estimates[i]);
    report_.registration = register_mesh(truth_, nearest, all);
    note_registration(report_.registration);
    report_.registration.T_truth_estimate =
        report_.registration.T_truth_estimate * options_.T_truth_estimate;
    place(report_.registration.T_truth_estimate);
  }

  // Adds notes if `found`, the motion of the estimates by ICP, is not as expected.
  void note_registration(const Registration& found) {
    Eigen::AlignedBox3d box;
    for (const LabelledMesh& mesh : moved_)
      for (const Eigen::Vector3f& vertex : mesh.vertices) box.extend(vertex.cast<double>());
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d corner = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
      report_.moved_m =
          std::max(report_.moved_m, (found.T_truth_estimate * corner - corner).norm());
    }
    const double turn_deg = angle_of(found.T_truth_estimate.linear()) * 180.0 / M_PI;
    if (report_.moved_m > kLargeMove_m || turn_deg > kLargeTurn_deg)
      report_.notes.push_back("registration moved the estimate by up to " +
                              fixed(report_.moved_m, 2) + " m and " + fixed(turn_deg, 2) +
                              " degrees: is it in the frame of the truth?");
    if (!found.converged)
      report_.notes.push_back("registration did not converge in " +
                              std::to_string(found.iterations) + " iterations");
    if (found.free_directions > 0)
      report_.notes.push_back("the surfaces leave " + std::to_string(found.free_directions) +
                              " of 6 directions open; registration did not move along these");
  }

  // Samples both sides with the same density, below max_samples.
  void sample() {
    begin("sampling");
    for (;;) {
      estimates_ = sampled_estimates(per_m2_);
      true_samples_ = sampled_truth(per_m2_, options_.crop_m, estimates_);
      if (true_samples_.near <= options_.max_samples) return;
      per_m2_ *= 0.98 * static_cast<double>(options_.max_samples) /
                 static_cast<double>(true_samples_.near);
    }
  }

  void note_density() {
    if (per_m2_ >= options_.samples_per_m2) return;
    std::size_t estimated = 0;
    for (const SurfaceSamples& samples : estimates_) estimated += samples.points.size();
    report_.notes.push_back(
        "sampled at " + fixed(per_m2_, 0) + " points per square metre instead of " +
        fixed(options_.samples_per_m2, 0) + ", to stay below " +
        std::to_string(options_.max_samples) + ": " + std::to_string(estimated) +
        " estimated and " + std::to_string(true_samples_.points.size()) + " true points");
  }

  void note_labels() {
    std::string without = truth_.labels.empty() ? "truth" : "";
    for (const MeshInput& input : inputs_)
      if (input.mesh.labels.empty()) without += (without.empty() ? "" : ", ") + input.name;
    report_.has_labels = without.empty();
    if (!report_.has_labels) report_.notes.push_back("labels are not judged: none in " + without);
  }

  void describe() {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      MeshReport& report = reports_[i / robots_];
      MeshError& error = report.robots.emplace_back();
      error.name = inputs_[i].name;
      error.area_m2 = surface_area(moved_[i]);
      error.faces = moved_[i].faces.size();
      report.merged.name = "merged";
      report.merged.area_m2 += error.area_m2;
      report.merged.faces += error.faces;
    }
  }

  [[nodiscard]] PointMatches matches_of_truth(std::size_t input) const {
    begin("indexing the estimate");
    const NearestSurface nearest(moved_[input], estimates_[input]);
    return match_points({truth_, true_samples_}, {moved_[input], estimates_[input]}, nearest,
                        options_.crop_m, "true points to " + inputs_[input].name, progress_);
  }

  void compare_truth() {
    std::vector<PointMatches> merged(reports_.size());
    for (std::size_t robot = 0; robot < robots_; ++robot) {
      std::vector<PointMatches> matches;
      for (std::size_t state = 0; state < reports_.size(); ++state) {
        matches.push_back(matches_of_truth(state * robots_ + robot));
        if (robot == 0)
          merged[state] = matches.back();
        else
          keep_nearer(merged[state], matches.back());
      }
      judge_truth(matches, [&](MeshReport& report) -> MeshError& { return report.robots[robot]; });
    }
    if (robots_ > 1)
      judge_truth(merged, [](MeshReport& report) -> MeshError& { return report.merged; });
  }

  // `states`: matches of one mesh, by state.
  void judge_truth(const std::vector<PointMatches>& states, const auto& error_of) {
    std::vector<SharedPoint> shared(true_samples_.points.size());
    for (const PointMatches& matches : states)
      for (std::size_t i = 0; i < shared.size(); ++i) {
        shared[i].near |= matches[i].is_near();
        shared[i].in_front |= matches[i].in_front;
        shared[i].labelled |= has_label(matches[i]);
      }
    const auto share = [&](auto count) {
      return static_cast<double>(count) / static_cast<double>(true_samples_.total);
    };
    for (std::size_t state = 0; state < states.size(); ++state) {
      const PointMatches& matches = states[state];
      MeshError& error = error_of(reports_[state]);
      error.truth = judged(matches, shared, &SharedPoint::near);
      error.seen = judged(matches, shared, &SharedPoint::in_front);
      error.coverage = share(std::ranges::count_if(matches, &PointMatch::is_near));
      error.seen_coverage = share(std::ranges::count_if(matches, &PointMatch::in_front));
    }
  }

  // Whether the label of a match is judged.
  [[nodiscard]] bool has_label(const PointMatch& match) const {
    return static_cast<double>(match.point_m) <= options_.label_distance_m;
  }

  // Distances of the points for which counts(i) is true.
  [[nodiscard]] SurfaceComparison distances(const PointMatches& matches, const auto& counts) const {
    const auto limit = static_cast<float>(options_.crop_m);
    std::vector<float> point_m;
    std::vector<float> surface_m;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (!counts(i)) continue;
      point_m.push_back(std::min(matches[i].point_m, limit));
      surface_m.push_back(std::min(matches[i].surface_m, limit));
    }
    return {summary_of(std::move(point_m)), summary_of(std::move(surface_m)), {}};
  }

  // Comparison from the true points for which the member `counts` is true.
  [[nodiscard]] SurfaceComparison judged(const PointMatches& matches,
                                         const std::vector<SharedPoint>& shared,
                                         bool SharedPoint::*counts) const {
    SurfaceComparison result = distances(matches, [&](std::size_t i) { return shared[i].*counts; });
    if (!report_.has_labels) return result;
    for (std::size_t i = 0; i < matches.size(); ++i)
      if (shared[i].*counts && shared[i].labelled)
        result.labels.add(SampledMesh{truth_, true_samples_}.label(i),
                          has_label(matches[i]) ? matches[i].label : LabelId{0});
    return result;
  }

  void compare_estimates() {
    begin("indexing the truth");
    const NearestSurface nearest(truth_, true_samples_);
    for (std::size_t state = 0; state < reports_.size(); ++state) compare_estimates(nearest, state);
  }

  void compare_estimates(const NearestSurface& nearest, std::size_t state) {
    MeshReport& report = reports_[state];
    PointMatches all;
    for (std::size_t robot = 0; robot < robots_; ++robot) {
      const std::size_t i = state * robots_ + robot;
      const SampledMesh estimate{moved_[i], estimates_[i]};
      const PointMatches matches =
          match_points(estimate, {truth_, true_samples_}, nearest, options_.crop_m,
                       inputs_[i].name + " to the truth", progress_);
      MeshError& error = report.robots[robot];
      for (std::size_t k = 0; report_.has_labels && k < matches.size(); ++k)
        if (has_label(matches[k])) error.estimate.labels.add(matches[k].label, estimate.label(k));
      report.merged.estimate.labels.add(error.estimate.labels);
      judge_estimate(matches, error);
      all.insert(all.end(), matches.begin(), matches.end());
    }
    if (robots_ > 1) judge_estimate(all, report.merged);
  }

  void judge_estimate(const PointMatches& matches, MeshError& error) const {
    SurfaceComparison found = distances(matches, [](std::size_t) { return true; });
    found.labels = error.estimate.labels;
    error.estimate = std::move(found);
    const auto limit = static_cast<float>(options_.crop_m);
    const auto beyond = std::ranges::count_if(
        matches, [&](const PointMatch& match) { return match.point_m >= limit; });
    error.beyond = ratio(static_cast<std::size_t>(beyond), matches.size());
  }

  const LabelledMesh& truth_;
  const std::vector<MeshInput> inputs_;  // by state, then robot
  const std::size_t robots_;             // meshes of one state
  const MeshErrorOptions& options_;
  const MeshProgress& progress_;
  double per_m2_ = 0.0;
  float longest_m_ = 0.0F;           // longest edge: ten diagonals of the truth's box
  std::vector<LabelledMesh> moved_;  // the estimates in the truth's frame
  std::vector<SurfaceSamples> estimates_;
  SurfaceSamples true_samples_;
  MeshReport report_;                // common to the reports of all states
  std::vector<MeshReport> reports_;  // by state
};

}  // namespace

double LabelScore::accuracy() const {
  return ratio(right, points());
}

void LabelScore::add(const LabelScore& other) {
  right += other.right;
  wrong += other.wrong;
  unknown += other.unknown;
}

void LabelConfusion::add(LabelId truth, LabelId estimate) {
  LabelScore& score = scores_[truth];
  ++(estimate == truth ? score.right : estimate == 0 ? score.unknown : score.wrong);
}

void LabelConfusion::add(const LabelConfusion& other) {
  for (std::size_t id = 0; id < scores_.size(); ++id) scores_[id].add(other.scores_[id]);
}

std::vector<LabelScore> LabelConfusion::by_class() const {
  std::vector<LabelScore> scores;
  for (std::size_t id = 1; id < scores_.size(); ++id)
    if (scores_[id].points() > 0) {
      scores.push_back(scores_[id]);
      scores.back().id = static_cast<LabelId>(id);
    }
  return scores;
}

LabelScore LabelConfusion::total() const {
  LabelScore total;
  for (const LabelScore& score : by_class()) total.add(score);
  return total;
}

void check_labels(const LabelledMesh& mesh, const std::string& name, const LabelPalette& palette,
                  const std::string& palette_name) {
  std::bitset<256> used;
  for (const LabelId label : mesh.labels) used.set(label);
  for (std::size_t id = 1; id < used.size(); ++id)
    if (used[id] && palette.find(static_cast<LabelId>(id)) == nullptr)
      throw std::invalid_argument(name + ": label " + std::to_string(id) + " is not in " +
                                  palette_name);
}

MeshReport mesh_error(const LabelledMesh& truth, std::span<const MeshInput> estimates,
                      const MeshErrorOptions& options, const MeshProgress& progress) {
  return Evaluation(truth, {estimates.begin(), estimates.end()}, estimates.size(), options,
                    progress)
      .run()
      .front();
}

MeshChange mesh_change(const LabelledMesh& truth, std::span<const MeshInput> before,
                       std::span<const MeshInput> after, const MeshErrorOptions& options) {
  if (before.size() != after.size())
    throw std::invalid_argument(std::to_string(before.size()) + " meshes before and " +
                                std::to_string(after.size()) + " after: one each for a robot");
  std::vector<MeshInput> all(before.begin(), before.end());
  for (const MeshInput& input : after) all.push_back(input);
  std::vector<MeshReport> reports = Evaluation(truth, all, before.size(), options, {}).run();
  return {std::move(reports[0]), std::move(reports[1])};
}

}  // namespace km

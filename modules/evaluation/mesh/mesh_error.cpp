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
#include "modules/core/quantile.hpp"
#include "modules/core/text_table.hpp"

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

Eigen::Vector3f normal_of(const LabelledMesh& mesh, std::uint32_t face) {
  const auto [a, b, c] = mesh.faces[face];
  return (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
}

// A mesh with points on it; both outlive this.
struct SampledMesh {
  const LabelledMesh& mesh;
  const SurfaceSamples& samples;

  [[nodiscard]] LabelId label(std::size_t sample) const {
    return mesh.face_label(samples.faces[sample]);
  }
};

// The nearest surface of another mesh for each point of a mesh. All arrays are as long as the
// points.
struct PointMatches {
  // Distance to the nearest sample; infinite if none is within reach.
  std::vector<float> point_m;
  std::vector<float> surface_m;  // See NearestSample::surface_m; infinite if none is within reach.
  std::vector<LabelId> labels;   // Labels of the nearest face (NearestSample::face); 0 if none.

  // Whether that face is in front of the point: the mesh does not end there, and the two faces do
  // not face opposite ways. Otherwise the point may be on surface that the other mesh never saw,
  // such as the ground below a car or the back of a wall.
  std::vector<bool> in_front;

  // Takes the values of `other` where its surface is nearer. A point in front of either mesh is in
  // front. Precondition: both matches have the same points.
  void keep_nearer(const PointMatches& other) {
    for (std::size_t i = 0; i < point_m.size(); ++i) {
      point_m[i] = std::min(point_m[i], other.point_m[i]);
      in_front[i] = in_front[i] || other.in_front[i];
      if (other.surface_m[i] >= surface_m[i]) continue;
      surface_m[i] = other.surface_m[i];
      labels[i] = other.labels[i];
    }
  }
};

// The true points that count for one of two states of a mesh: those that either state can show.
struct SharedPoints {
  std::vector<bool> near;      // within reach
  std::vector<bool> in_front;  // see PointMatches
  std::vector<bool> labelled;  // within the distance at which labels are judged

  void add(const PointMatches& matches, double label_distance_m) {
    near.resize(matches.point_m.size());
    in_front.resize(matches.point_m.size());
    labelled.resize(matches.point_m.size());
    for (std::size_t i = 0; i < near.size(); ++i) {
      near[i] = near[i] || std::isfinite(matches.point_m[i]);
      in_front[i] = in_front[i] || matches.in_front[i];
      labelled[i] = labelled[i] || static_cast<double>(matches.point_m[i]) <= label_distance_m;
    }
  }
};

// Uses OpenCV's threads; the result does not depend on their number. Calls `progress` with `stage`.
PointMatches match_points(const SampledMesh& from, const SampledMesh& to,
                          const NearestSurface& nearest_to, double reach_m, std::string_view stage,
                          const MeshProgress& progress) {
  const std::size_t count = from.samples.points.size();
  PointMatches matches;
  matches.point_m.assign(count, std::numeric_limits<float>::infinity());
  matches.surface_m = matches.point_m;
  matches.labels.assign(count, 0);
  std::vector<std::uint8_t> in_front(count, 0);  // threads may write neighbouring bytes, not bits
  const auto match = [&](std::size_t i) {
    const auto near = nearest_to.find(from.samples.points[i], reach_m);
    if (!near) return;
    matches.point_m[i] = near->distance_m;
    matches.surface_m[i] = near->surface_m;
    matches.labels[i] = to.mesh.face_label(near->face);
    const Eigen::Vector3f normal = normal_of(from.mesh, from.samples.faces[i]);
    in_front[i] = !near->past_boundary && normal.dot(normal_of(to.mesh, near->face)) > 0.0F ? 1 : 0;
  };
  for (std::size_t start = 0; start < count; start += kChunk) {
    if (progress) progress(stage, static_cast<double>(start) / static_cast<double>(count));
    const auto size = static_cast<int>(std::min(kChunk, count - start));
    cv::parallel_for_(cv::Range(0, size), [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) match(start + static_cast<std::size_t>(i));
    });
  }
  matches.in_front.assign(in_front.begin(), in_front.end());
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
          merged[state].keep_nearer(matches.back());
      }
      judge_truth(matches, [&](MeshReport& report) -> MeshError& { return report.robots[robot]; });
    }
    if (robots_ > 1)
      judge_truth(merged, [](MeshReport& report) -> MeshError& { return report.merged; });
  }

  // `matches`: of one mesh, by state.
  void judge_truth(const std::vector<PointMatches>& matches, const auto& error_of) {
    SharedPoints points;
    for (const PointMatches& state : matches) points.add(state, options_.label_distance_m);
    const auto total = static_cast<double>(true_samples_.total);
    const auto share = [&](auto count) { return static_cast<double>(count) / total; };
    for (std::size_t state = 0; state < matches.size(); ++state) {
      MeshError& error = error_of(reports_[state]);
      error.truth = judged(matches[state], points, points.near);
      error.seen = judged(matches[state], points, points.in_front);
      error.coverage = share(std::ranges::count_if(
          matches[state].point_m, [](float distance_m) { return std::isfinite(distance_m); }));
      error.seen_coverage = share(std::ranges::count(matches[state].in_front, true));
    }
  }

  // Comparison from the true points that `counts` has.
  [[nodiscard]] SurfaceComparison judged(const PointMatches& matches, const SharedPoints& points,
                                         const std::vector<bool>& counts) const {
    const auto limit = static_cast<float>(options_.crop_m);
    std::vector<float> point_m;
    std::vector<float> surface_m;
    SurfaceComparison result;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (!counts[i]) continue;
      point_m.push_back(std::min(matches.point_m[i], limit));
      surface_m.push_back(std::min(matches.surface_m[i], limit));
      if (!report_.has_labels || !points.labelled[i]) continue;
      const bool is_near = static_cast<double>(matches.point_m[i]) <= options_.label_distance_m;
      result.labels.add(SampledMesh{truth_, true_samples_}.label(i),
                        is_near ? matches.labels[i] : LabelId{0});
    }
    result.point = summary_of(std::move(point_m));
    result.surface = summary_of(std::move(surface_m));
    return result;
  }

  void compare_estimates() {
    begin("indexing the truth");
    const NearestSurface nearest(truth_, true_samples_);
    for (std::size_t state = 0; state < reports_.size(); ++state) compare_estimates(nearest, state);
  }

  void compare_estimates(const NearestSurface& nearest, std::size_t state) {
    MeshReport& report = reports_[state];
    std::vector<float> all_point_m;
    std::vector<float> all_surface_m;
    for (std::size_t robot = 0; robot < robots_; ++robot) {
      const std::size_t i = state * robots_ + robot;
      const SampledMesh estimate{moved_[i], estimates_[i]};
      const PointMatches matches =
          match_points(estimate, {truth_, true_samples_}, nearest, options_.crop_m,
                       inputs_[i].name + " to the truth", progress_);
      MeshError& error = report.robots[robot];
      error.estimate.labels = labels_of(estimate, matches);
      report.merged.estimate.labels.add(error.estimate.labels);
      const std::size_t start = all_point_m.size();
      append_clamped(matches.point_m, all_point_m);
      append_clamped(matches.surface_m, all_surface_m);
      judge_estimate(std::span(all_point_m).subspan(start), std::span(all_surface_m).subspan(start),
                     error);
    }
    if (robots_ > 1) judge_estimate(all_point_m, all_surface_m, report.merged);
  }

  void append_clamped(const std::vector<float>& distances_m, std::vector<float>& all_m) const {
    const auto limit = static_cast<float>(options_.crop_m);
    for (const float distance_m : distances_m) all_m.push_back(std::min(distance_m, limit));
  }

  [[nodiscard]] LabelConfusion labels_of(const SampledMesh& estimate,
                                         const PointMatches& matches) const {
    LabelConfusion labels;
    if (!report_.has_labels) return labels;
    for (std::size_t i = 0; i < matches.point_m.size(); ++i)
      if (static_cast<double>(matches.point_m[i]) <= options_.label_distance_m)
        labels.add(matches.labels[i], estimate.label(i));
    return labels;
  }

  void judge_estimate(std::span<const float> point_m, std::span<const float> surface_m,
                      MeshError& error) const {
    const auto limit = static_cast<float>(options_.crop_m);
    const auto beyond = std::count_if(point_m.begin(), point_m.end(),
                                      [&](float distance_m) { return distance_m >= limit; });
    error.beyond = static_cast<double>(beyond) / static_cast<double>(point_m.size());
    error.estimate.point = summary_of({point_m.begin(), point_m.end()});
    error.estimate.surface = summary_of({surface_m.begin(), surface_m.end()});
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
                       std::span<const MeshInput> after, const MeshErrorOptions& options,
                       const MeshProgress& progress) {
  if (before.size() != after.size())
    throw std::invalid_argument(std::to_string(before.size()) + " meshes before and " +
                                std::to_string(after.size()) + " after: one each for a robot");
  std::vector<MeshInput> all(before.begin(), before.end());
  for (const MeshInput& input : after) all.push_back(input);
  std::vector<MeshReport> reports = Evaluation(truth, all, before.size(), options, progress).run();
  return {std::move(reports[0]), std::move(reports[1])};
}

}  // namespace km
